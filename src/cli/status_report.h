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

/// The content of `status` and `watch`, read once, in the units of the CORBA interface.
struct StatusReport {
  std::string name;
  std::string address;
  Corbot::RobotState state{};
  Corbot::RobotKind kind{};
  bool paused{};               ///< until a resume
  std::vector<double> joints;  ///< degrees; metres for a sliding joint
  struct Joint {
    std::string name;
    bool slides{};
  };
  std::vector<Joint> joint_info;  ///< empty if the servant does not report them: all are rotary
  std::vector<Corbot::JointRange> ranges;
  std::vector<Corbot::JointRange> soft_limits;  ///< equal to the ranges unless set; empty: not known
  Corbot::CartesianCoord pose{};
  Corbot::GripperState gripper{};
  double reach_m{};
  double override_percent{};
  std::optional<Corbot::SpeedSettings> speeds;  ///< none: an older servant
  double tool_pitch_deg{};
  std::optional<Corbot::Quaternion> tool_orientation;  ///< as set; none: no orientation is set
  struct Frames {
    Corbot::Pose tool, base;
  };
  std::optional<Frames> frames;  ///< in force; none: an older servant
  std::vector<ActiveAlarm> active_alarms;
  Corbot::DeviceInfo device{};
  Corbot::ServantInfo servant{};                    ///< empty: an older servant, which does not report it
  Corbot::ControlInfo control{};                    ///< empty: an older servant
  std::optional<double> cycle_age_s;                ///< of joints, tool and motion; none: an older servant
  Corbot::Ticket motion{0};                         ///< under way; 0: none, or an older servant
  double progress{};                                ///< of that motion, 0 ... 1
  std::optional<Corbot::GripperInfo> gripper_info;  ///< none: an older servant
};

}  // namespace corbot::cli
