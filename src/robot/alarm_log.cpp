// SPDX-License-Identifier: Apache-2.0
#include "robot/alarm_log.h"

#include <fmt/format.h>

#include <chrono>
#include <iterator>
#include <numbers>

namespace corbot {
namespace {

double degrees(double angle_rad) { return angle_rad * 180.0 / std::numbers::pi; }

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

/// DeviceCause of rt/backends/serial_port.h in words.
const char* cause(double number) {
  static constexpr const char* kCauses[] = {"",
                                            ": it is not there",
                                            ": another program uses it",
                                            ": the line was cut",
                                            ": it takes no more bytes",
                                            ": it does not answer",
                                            ": it answers nonsense",
                                            ": it reports a fault",
                                            ": the bus is down",
                                            ": a drive has fallen silent"};
  return number >= 0.0 && number < std::size(kCauses) ? kCauses[static_cast<std::size_t>(number)] : "";
}

std::string words(const AlarmEvent& event) {
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
      return "the servo device answers late or with faults";
    case AlarmCode::kBackendLost:
      return fmt::format("the servo device is lost{}; the arm holds", cause(event.value));
    case AlarmCode::kEmergencyStop:
      return "emergency stop";
    case AlarmCode::kOverrun:
      return fmt::format("{:.0f} cycles of the real-time loop overran", event.value);
  }
  return fmt::format("alarm {}", static_cast<std::uint32_t>(event.code));
}

}  // namespace

void AlarmLog::add(const AlarmEvent& event) {
  push({static_cast<double>(event.time_ns) * 1e-9, static_cast<std::int32_t>(event.code),
        causes_error(event.code), words(event)});
}

void AlarmLog::add(std::int32_t code, bool active, const std::string& text) {
  const auto now = std::chrono::system_clock::now().time_since_epoch();
  push({std::chrono::duration<double>(now).count(), code, active, text});
}

void AlarmLog::push(AlarmEntry entry) {
  const std::lock_guard lock(mutex_);
  entries_.push_back(std::move(entry));
  if (entries_.size() > kKept) entries_.pop_front();
}

void AlarmLog::deactivate() {
  const std::lock_guard lock(mutex_);
  for (AlarmEntry& entry : entries_) entry.active = entry.code == kAlarmTaskGone && entry.active;
}

void AlarmLog::deactivate(std::int32_t code) {
  const std::lock_guard lock(mutex_);
  for (AlarmEntry& entry : entries_) entry.active = entry.active && entry.code != code;
}

std::vector<AlarmEntry> AlarmLog::list() const {
  const std::lock_guard lock(mutex_);
  return {entries_.begin(), entries_.end()};
}

std::string AlarmLog::cause() const {
  const std::lock_guard lock(mutex_);
  for (auto entry = entries_.rbegin(); entry != entries_.rend(); ++entry) {
    if (entry->active) return entry->text;
  }
  return {};
}

}  // namespace corbot
