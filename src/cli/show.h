// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "client/client.h"
#include "client/stop_on_signal.h"

namespace corbot::cli {

struct ActiveAlarm {
  long code{};  ///< an AlarmCode
  std::string text;
};

/// What `status` and `watch` show, read once. Units of the CORBA interface.
struct StatusReport {
  std::string name;
  std::string address;
  Corbot::RobotState state{};
  Corbot::RobotKind kind{};
  bool paused{};               ///< until a resume
  std::vector<double> joints;  ///< degrees
  std::vector<Corbot::JointRange> ranges;
  std::vector<Corbot::JointRange> soft_limits;  ///< as the ranges, unless they were set; empty: not known
  Corbot::CartesianCoord pose{};
  Corbot::GripperState gripper{};
  double reach_m{};
  double override_percent{};
  double tool_pitch_deg{};
  std::optional<Corbot::Quaternion> tool_orientation;  ///< that is set; none: none is
  std::vector<ActiveAlarm> active_alarms;
  Corbot::DeviceInfo device{};
  Corbot::ServantInfo servant{};                    ///< empty: one of an earlier version, which does not say
  Corbot::ControlInfo control{};                    ///< the same
  std::optional<double> cycle_age_s;                ///< of joints, tool and motion; none: the same
  Corbot::Ticket motion{0};                         ///< under way; 0: none, or the same
  double progress{};                                ///< of that motion, 0 ... 1
  std::optional<Corbot::GripperInfo> gripper_info;  ///< none: the same
};

[[nodiscard]] StatusReport read_status(client::Client& client);
[[nodiscard]] std::string status_text(const StatusReport& report);
/// One line, for `watch` without a terminal.
[[nodiscard]] std::string status_line(const StatusReport& report);
[[nodiscard]] std::string status_json(const StatusReport& report);

[[nodiscard]] std::string alarms_text(const Corbot::AlarmList& alarms);
[[nodiscard]] std::string alarms_json(const Corbot::AlarmList& alarms);
[[nodiscard]] std::string diagnostics_text(const Corbot::LoopInfo& info, const Corbot::DeviceInfo& device);
[[nodiscard]] std::string diagnostics_json(const Corbot::LoopInfo& info, const Corbot::DeviceInfo& device);

/// Latency below which the share `ratio` of the wake-ups lies, by the histogram; seconds. The upper edge of
/// the bucket, so never too good; the maximum where the last, open bucket is meant.
[[nodiscard]] double latency_quantile(const Corbot::LoopInfo& info, double ratio);

/// Shows the status every `interval_s` until a signal was seen, or `count` times (0 = no end); redrawn on a
/// terminal, else a line each.
void watch(client::Client& client, const client::OnSignal& on_signal, double interval_s, int count);

}  // namespace corbot::cli
