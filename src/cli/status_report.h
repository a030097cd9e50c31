// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "arm.hh"

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
  std::vector<double> joints;  ///< degrees; metres of one that slides
  struct Joint {
    std::string name;
    bool slides{};
  };
  std::vector<Joint> joint_info;  ///< empty where the servant does not say: all turn
  std::vector<Corbot::JointRange> ranges;
  std::vector<Corbot::JointRange> soft_limits;  ///< as the ranges, unless they were set; empty: not known
  Corbot::CartesianCoord pose{};
  Corbot::GripperState gripper{};
  double reach_m{};
  double override_percent{};
  std::optional<Corbot::SpeedSettings> speeds;  ///< none: a servant of an earlier version
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

}  // namespace corbot::cli
