// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <string>
#include <vector>

#include "client/stop_on_signal.h"
#include "config/profile.h"
#include "corbot/channel/records.h"
#include "corbot/kinematics/joints.h"

namespace corbot::cli {

struct RecordOptions {
  std::string robot;  ///< its name
  std::string file;   ///< "-" = standard output
  double for_s{0};    ///< 0 = until the signal
  bool force{false};  ///< overwrite
  /// all six, rotary, if they are not known
  std::vector<JointKind> joints = std::vector<JointKind>(kMaxJoints);
  std::string notes{};  ///< csv_notes(), if the profile is known
};

/// Returns lines that begin with `#`: the profile's name, and the limits of each joint (degrees or m,
/// seconds).
[[nodiscard]] std::string csv_notes(const Profile& profile);

/// Return the column names, with units (`theta0_deg`, `slide2_m`), and one row; both end with a line end.
/// Joints that no device measures are empty. The speeds are those of the set-points.
[[nodiscard]] std::string csv_header(std::span<const JointKind> joints);
[[nodiscard]] std::string csv_row(const Snapshot& snapshot, std::span<const JointKind> joints);

/// Writes every cycle of the trace from now on until the signal, the time or the robot's end; read-only.
/// Prints a summary to standard error. Throws Failure.
void record(const RecordOptions& options, const client::OnSignal& on_signal);

}  // namespace corbot::cli
