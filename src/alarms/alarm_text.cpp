// SPDX-License-Identifier: Apache-2.0
#include "alarms/alarm_text.h"

#include <fmt/format.h>

#include <cstdint>
#include <numbers>

namespace corbot {
namespace {

double degrees(double angle_rad) { return angle_rad * 180.0 / std::numbers::pi; }

std::string because(double cause) {
  if (!(cause >= 0.0 && cause < 1e6)) return {};
  const std::string text = device_cause_text(to_device_cause(static_cast<std::uint32_t>(cause)));
  return text.empty() ? text : ": " + text;
}

}  // namespace

bool causes_error(AlarmCode code) {
  switch (code) {
    case AlarmCode::kCommandRefused:
    case AlarmCode::kRingCorrupt:
    case AlarmCode::kBackendDegraded:
    case AlarmCode::kOverrun:
      return false;
    default:
      return true;
  }
}

std::string alarm_text(const AlarmEvent& event) {
  switch (event.code) {
    case AlarmCode::kSetPointNotFinite:
      return fmt::format("set-point of articulation {} is not a number; the arm holds", event.joint);
    case AlarmCode::kSetPointOutOfRange:
      return fmt::format(
          "set-point of articulation {} at {:.3f} degrees is out of range {:.3f} to {:.3f}; the arm holds",
          event.joint, degrees(event.value), degrees(event.lower), degrees(event.upper));
    case AlarmCode::kSetPointDiscontinuous:
      return fmt::format(
          "set-point of articulation {} would step by {:.4f} degrees in a cycle, limit {:.4f}; the arm holds",
          event.joint, degrees(event.value), degrees(event.upper));
    case AlarmCode::kKinematicsFailed:
      return fmt::format("a point of the path has no inverse at {:.3f} s of {:.3f} s; the arm holds",
                         event.value, event.upper);
    case AlarmCode::kCommandRefused:
      return fmt::format("the real-time task refused command {:.0f} (verdict {:.0f}, value {:.6g})",
                         event.value, event.lower, event.upper);
    case AlarmCode::kRingCorrupt:
      return "the command ring made no sense and was emptied";
    case AlarmCode::kBackendDegraded:
      return "the servo device answers late or with faults" + because(event.value);
    case AlarmCode::kBackendLost:
      return fmt::format("the servo device is lost{}; the arm holds", because(event.value));
    case AlarmCode::kEmergencyStop:
      return "emergency stop";
    case AlarmCode::kErrorTakenUp:
      return "the arm was in Error, or stopped, when the real-time task was restarted; it holds";
    case AlarmCode::kOverrun:
      return fmt::format("{:.0f} cycles of the real-time loop overran", event.value);
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
  }
  return "";
}

}  // namespace corbot
