// SPDX-License-Identifier: Apache-2.0
#include "alarms/alarm_text.h"

#include <fmt/format.h>

#include <array>
#include <cstdint>
#include <string>
#include <utility>

#include "corbot/backend/emergency_stop.h"
#include "corbot/channel/alarms.h"

namespace corbot {
namespace {

std::string because(const AlarmEvent& event) {
  const std::string text = device_cause_text(alarm::backend_cause(event));
  return text.empty() ? text : ": " + text;
}

std::string axis(std::int32_t joint) {
  return joint < 0 ? std::string("the gripper") : fmt::format("joint {}", joint);
}

/// Describes the sources that count as a press. Pressed inputs need no description.
std::string stop_sources_text(std::uint32_t sources) {
  static constexpr std::array<std::pair<StopSource, const char*>, 4> kCauses{{
      {StopSource::kGpioUnheard, "the line cannot be read"},
      {StopSource::kDeviceUnheard, "the device does not say how its input is"},
      {StopSource::kWatchdog, "the watchdog output has tripped"},
      {StopSource::kWatcher, "no thread watches the input"},
  }};
  std::string text;
  for (const auto& [source, cause] : kCauses) {
    if ((sources & static_cast<std::uint32_t>(source)) == 0) continue;
    text += text.empty() ? ": " : ", ";
    text += cause;
  }
  return text;
}

/// Returns the kind of an event's joint. A forged event may have an invalid joint.
JointKind kind_of(std::int32_t joint, const JointKinds& kinds) {
  const auto index = static_cast<std::size_t>(joint);
  return joint >= 0 && index < kinds.size() ? kinds[index] : JointKind::kRotary;
}

/// Returns "12.345 degrees", "0.012345 m".
std::string value_text(JointKind kind, double value_q, int decimals_of_degrees) {
  return fmt::format("{:.{}f} {}", to_shown(kind, value_q), decimals(kind, decimals_of_degrees),
                     unit_name(kind));
}
/// Returns the number without the unit.
std::string number_text(JointKind kind, double value_q, int decimals_of_degrees) {
  return fmt::format("{:.{}f}", to_shown(kind, value_q), decimals(kind, decimals_of_degrees));
}

std::string too_quick_text(const alarm::TooQuick& what, JointKind kind) {
  const char* const quantity = what.order == 1 ? "a speed" : what.order == 2 ? "an acceleration" : "a jerk";
  const char* const per = what.order == 1 ? "/s" : what.order == 2 ? "/s²" : "/s³";
  return fmt::format("set-points of joint {} would have {} of {}{}, limit {}; the arm is brought to rest",
                     what.joint, quantity, value_text(kind, what.value_q, 2), per,
                     number_text(kind, what.allowed_q, 2));
}

std::string outside_workspace_text(const alarm::OutsideWorkspace& what, std::span<const std::string> shapes) {
  const std::string shape = what.shape < shapes.size()
                                ? fmt::format("'{}'", shapes[what.shape])
                                : fmt::format("plane or box {} of the workspace", what.shape + 1);
  return fmt::format(
      "a set-point would put the {} {:.3g} mm beyond {}, limit {:.3g} mm; the arm is brought to rest",
      kPartNames[what.part], -1e3 * what.clearance_m, shape, 0.0 - 1e3 * what.least_m);
}

std::string out_of_range_text(const alarm::OutOfRange& what, const JointKinds& kinds) {
  if (what.joint < 0) {
    return fmt::format(
        "set-point of the gripper at {:.3f} is out of range {:.3f} to {:.3f}; the arm is brought to rest",
        what.position_q, what.lower_q, what.upper_q);
  }
  const JointKind kind = kind_of(what.joint, kinds);
  return fmt::format("set-point of joint {} at {} is out of range {} to {}; the arm is brought to rest",
                     what.joint, value_text(kind, what.position_q, 3), number_text(kind, what.lower_q, 3),
                     number_text(kind, what.upper_q, 3));
}

}  // namespace

bool causes_error(AlarmCode code) {
  switch (code) {
    case AlarmCode::kCommandRefused:
    case AlarmCode::kRingCorrupt:
    case AlarmCode::kBackendDegraded:
    case AlarmCode::kOverrun:
    case AlarmCode::kServantSilent:
      return false;
    default:
      return true;
  }
}

namespace {

std::string beyond_range_text(const alarm::OutOfRange& what, JointKind kind) {
  return fmt::format(
      "joint {} is at {}, outside its range of {} to {}: nothing moves by itself; {} it back by hand",
      what.joint, value_text(kind, what.position_q, 1), number_text(kind, what.lower_q, 1),
      number_text(kind, what.upper_q, 1), kind == JointKind::kRotary ? "turn" : "push");
}

}  // namespace

std::string alarm_text(const AlarmEvent& event, const JointKinds& kinds,
                       std::span<const std::string> shapes) {
  const JointKind kind = kind_of(event.joint, kinds);
  switch (event.code) {
    case AlarmCode::kSetPointNotFinite:
      return fmt::format("set-point of {} is not a number; the arm is brought to rest", axis(event.joint));
    case AlarmCode::kSetPointOutOfRange:
      return out_of_range_text(alarm::out_of_range(event), kinds);
    case AlarmCode::kSetPointDiscontinuous: {
      const alarm::Discontinuity what = alarm::discontinuity(event);
      return fmt::format(
          "set-point of joint {} would step by {} in a cycle, limit {}; the arm is brought to rest",
          what.joint, value_text(kind, what.step_q, 4), number_text(kind, what.allowed_q, 4));
    }
    case AlarmCode::kSetPointTooQuick:
      return too_quick_text(alarm::too_quick(event), kind);
    case AlarmCode::kSetPointOutsideWorkspace:
      return outside_workspace_text(alarm::outside_workspace(event), shapes);
    case AlarmCode::kKinematicsFailed: {
      const alarm::KinematicsFailure what = alarm::kinematics_failure(event);
      return fmt::format("path and kinematics disagree at {:.3f} s of {:.3f} s; the arm is brought to rest",
                         what.time_s, what.duration_s);
    }
    case AlarmCode::kFollowingError: {
      const alarm::JointDeviation what = alarm::joint_deviation(event);
      return fmt::format("joint {} is {} from its set-point, {} are allowed", what.joint,
                         value_text(kind, what.error_q, 3), number_text(kind, what.allowed_q, 3));
    }
    case AlarmCode::kGoalNotReached: {
      const alarm::JointDeviation what = alarm::joint_deviation(event);
      if (what.joint < 0) return "the servo device has not taken a motion's last set-point";
      return fmt::format("joint {} has not reached its goal: it is {} away, {} are allowed", what.joint,
                         value_text(kind, what.error_q, 3), number_text(kind, what.allowed_q, 3));
    }
    case AlarmCode::kJointBeyondRange:
      return beyond_range_text(alarm::out_of_range(event), kind);
    case AlarmCode::kCommandRefused: {
      const alarm::RefusedCommand what = alarm::refused_command(event);
      return fmt::format("the real-time task refused command {} (verdict {}, value {:.6g})", what.id,
                         static_cast<std::uint32_t>(what.verdict), what.value);
    }
    case AlarmCode::kRingCorrupt:
      return "the indices of the command ring were corrupt; the ring was emptied";
    case AlarmCode::kBackendDegraded:
      return "the servo device replies late or with faults" + because(event);
    case AlarmCode::kBackendLost:
      return fmt::format("the servo device is lost{}; set-points are held", because(event));
    case AlarmCode::kEmergencyStop:
      return "emergency stop" + stop_sources_text(alarm::emergency_stop_sources(event));
    case AlarmCode::kErrorInherited:
      return "the arm was in Error, or stopped, or its servos lost their power, when the last real-time task "
             "ended; set-points are held";
    case AlarmCode::kHeld:
      return "the arm was stopped and is held (StopAndHold)";
    case AlarmCode::kCleared:
      return "the Error was cleared";
    case AlarmCode::kOverrun: {
      const alarm::Overruns what = alarm::overruns(event);
      return fmt::format("the real-time loop missed periods {} times, {} since its start", what.count,
                         what.total);
    }
    case AlarmCode::kLoopGap:
      return fmt::format("the real-time loop made no cycle for {:.3g} s; set-points are held",
                         alarm::gap_s(event));
    case AlarmCode::kTaskReplaced:
      return "the real-time task did not respond and was replaced; set-points are held";
    case AlarmCode::kServantSilent:
      return "no servant responded while a motion ran or was queued; it was stopped on its path and has "
             "failed";
  }
  return fmt::format("alarm {}", static_cast<std::uint32_t>(event.code));
}

const char* device_cause_text(DeviceCause cause) {
  switch (cause) {
    case DeviceCause::kNone:
      return "";
    case DeviceCause::kNotThere:
      return "it is not there";
    case DeviceCause::kInUse:
      return "another program uses it";
    case DeviceCause::kHungUp:
      return "the line was cut";
    case DeviceCause::kWriteTimeout:
      return "write timed out";
    case DeviceCause::kNoAnswer:
      return "it does not answer";
    case DeviceCause::kBadAnswer:
      return "invalid reply";
    case DeviceCause::kDeviceFault:
      return "it reports a fault of its own";
    case DeviceCause::kBusDown:
      return "its bus is down";
    case DeviceCause::kHeartbeatLost:
      return "it went silent on its bus";
    case DeviceCause::kTorqueOff:
      return "safe torque off (STO), or its voltage is missing";
    case DeviceCause::kDisabled:
      return "a drive was disabled by itself";
    case DeviceCause::kTargetIgnored:
      return "a drive ignores its set-points";
    case DeviceCause::kTooSlow:
      return "it takes fewer set-points than it announced";
    case DeviceCause::kCountChanged:
      return "a drive counts otherwise than before its restart: reference it, then restart corbot";
    case DeviceCause::kThreadStill:
      return "a call to it does not return";
    case DeviceCause::kNoSetpoint:
      return "no set-point came for it: the cycle stood still";
  }
  return "";
}

}  // namespace corbot
