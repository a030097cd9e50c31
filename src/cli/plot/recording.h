// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "cli/plot/reduced_rows.h"
#include "corbot/kinematics/joints.h"

namespace corbot::cli::charts {

/// Limits of a joint from a recording's first lines: degrees or m, and seconds.
struct RecordedLimits {
  double lower{}, upper{}, speed{}, acceleration{}, jerk{};
};

struct RecordedJoint {
  JointKind kind{JointKind::kRotary};
  std::string name;  ///< empty if the recording has none
  std::optional<RecordedLimits> limits;
  [[nodiscard]] const char* unit() const noexcept { return kind == JointKind::kRotary ? "deg" : "m"; }
};

/// The quantities of each joint in a recording. Accelerations and jerks are difference quotients of the
/// speeds of consecutive cycles over one period. After more than five missed periods they begin anew.
enum class Quantity { kSetPoint, kMeasured, kSpeed, kAcceleration, kJerk, kPulse };
inline constexpr std::size_t kQuantities = 6;

/// Rates of a joint in one cycle.
struct JointRates {
  double speed{kNoValue}, acceleration{kNoValue}, jerk{kNoValue};
  /// Returns the rates `period_s` later.
  [[nodiscard]] JointRates next(double next_speed, double period_s) const noexcept {
    const double next_acceleration = (next_speed - speed) / period_s;
    return {next_speed, next_acceleration, (next_acceleration - acceleration) / period_s};
  }
};

/// A file of `corbot record`, or a planned motion, reduced.
struct Recording {
  std::string profile;  ///< empty if the file does not name it
  std::vector<RecordedJoint> joints;
  std::uint64_t cycles{};
  std::uint64_t missing{};  ///< cycles missing between two cycles of one task
  std::uint64_t late{};     ///< cycles before which the loop missed periods
  double latest_s{};        ///< by how much the latest of them was late
  ReducedRows rows{0};

  [[nodiscard]] static std::size_t series_of(std::size_t joint, Quantity quantity) noexcept {
    return joint * kQuantities + static_cast<std::size_t>(quantity);
  }
  [[nodiscard]] std::size_t gripper_pulse() const noexcept { return joints.size() * kQuantities; }
  [[nodiscard]] double duration_s() const noexcept { return rows.rows().back().end_s; }
};

/// Reads a recording. Throws Failure, kUsage with "FILE:LINE: reason", if the file is not a recording of at
/// least two cycles.
[[nodiscard]] Recording read_recording(const std::string& file);

}  // namespace corbot::cli::charts
