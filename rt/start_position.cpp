// SPDX-License-Identifier: Apache-2.0
#include "rt/start_position.h"

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "corbot/motion/bounds.h"
#include "corbot/units.h"
#include "rt/cycle/set_point_check.h"

namespace corbot::rt {
namespace {

/// A controller reports its pulses in steps of up to 10 us, 1 degree of a usual servo.
constexpr double kSamePulse_rad = to_radians(2.0);
/// A joint may hang that far beyond its end; it is brought back, slowly.
constexpr double kNearRange_rad = to_radians(3.0);

std::string degrees(const ArmModel& arm, const Joints& position_rad) {
  std::string text;
  for (std::size_t i = 0; i < arm.dof; ++i) {
    text += fmt::format("{}{:.1f}", i == 0 ? "" : " ", to_degrees(position_rad[i]) + 0.0);
  }
  return text + " degrees";
}

std::string slow_note(bool unverified) {
  if (!unverified) return "";
  return fmt::format("; position unverified: the first motion runs at {:g} % of its speed",
                     100.0 * kFirstMotionOverride);
}

}  // namespace

StartPosition::StartPosition(const Profile& profile, const std::string& robot,
                             const std::string& state_directory)
    : profile_(profile),
      fingerprint_(position_fingerprint(profile.arm)),
      was_unpowered_(unpowered_after_exit(profile) && !profile.backend.position_known_at_start),
      robot_(robot) {
  const std::filesystem::path directory =
      state_directory.empty() ? default_state_directory() : std::filesystem::path(state_directory);
  if (!directory.empty()) store_.emplace(directory, robot, "rt");
}

CycleStart StartPosition::find(const TaskSegment& segment, const DevicePosition& device, bool forget) {
  refuse_impossible(device);
  CycleStart start = decide(segment, device, forget);
  start.power_cut_at_stop = !profile_.power_enable.chip.empty() && profile_.power_enable.off_at_stop &&
                            !profile_.backend.position_known_at_start;
  start.position_fingerprint = fingerprint_;
  spdlog::log(start.unverified ? spdlog::level::warn : spdlog::level::info, "position: {}", text_);
  return start;
}

void StartPosition::refuse_impossible(const DevicePosition& device) const {
  if (device.kind != DevicePosition::Kind::kMeasured) return;
  for (std::size_t i = 0; i < profile_.arm.dof; ++i) {
    const JointLimits& limits = profile_.arm.joints[i];
    const double at_rad = device.position_rad[i];
    if (at_rad >= limits.lower_rad - kNearRange_rad && at_rad <= limits.upper_rad + kNearRange_rad) continue;
    throw std::runtime_error(fmt::format(
        "joint {} is measured at {:.1f} degrees, outside its range of {:.1f} to {:.1f}: not started. Home "
        "its encoder, correct its drive's zero_count, counts_per_degree or direction, or turn it by hand "
        "into its range",
        profile_.joint_names[i], to_degrees(at_rad), to_degrees(limits.lower_rad),
        to_degrees(limits.upper_rad)));
  }
}

CycleStart StartPosition::decide(const TaskSegment& segment, const DevicePosition& device, bool forget) {
  Snapshot last{};
  const bool has_snapshot = last_snapshot(segment, last);
  const bool has_last = has_snapshot && is_in_range(profile_.arm, last.position_rad, kGateTolerance_rad);
  if (has_last && last.position_fingerprint == fingerprint_ && !was_unpowered_) {
    text_ = fmt::format("where the last real-time task left it{}",
                        slow_note((last.flags & kSnapshotUnverified) != 0));
    return {last.position_rad, last.gripper, (last.flags & kSnapshotUnverified) != 0};
  }
  const Saved file = has_last || forget ? Saved{} : read();
  const std::optional<LastPosition> saved = has_last ? by_pulses(last) : file.position;
  const std::optional<CycleStart> reported = from_device(device, saved);
  CycleStart start = reported ? *reported : has_last ? left_by(last, *saved) : assumed(saved);
  start.held = file.held || (has_snapshot && (last.flags & kSnapshotHeld) != 0);
  start.outranks_segment = true;
  return start;
}

/// The servos are where their pulses have put them, whatever angle that is by now.
LastPosition StartPosition::by_pulses(const Snapshot& last) const {
  LastPosition position = position_of(last, robot_);
  if (last.position_fingerprint == fingerprint_) return position;
  const ArmModel& arm = profile_.arm;
  for (std::size_t i = 0; i < arm.dof; ++i) {
    const ServoMap& map = arm.servos[i];
    const double at_rad = (last.pulse_us[i] - map.zero_us) / (map.direction * map.us_per_rad);
    position.position_rad[i] =
        std::isfinite(at_rad) ? std::clamp(at_rad, arm.joints[i].lower_rad, arm.joints[i].upper_rad) : 0.0;
  }
  const double opening =
      (last.pulse_us[arm.dof] - arm.gripper.closed_us) / (arm.gripper.open_us - arm.gripper.closed_us);
  position.opening = std::isfinite(opening) ? std::clamp(opening, 0.0, 1.0) : 0.0;
  return position;
}

CycleStart StartPosition::left_by(const Snapshot& last, const LastPosition& at) {
  const bool is_same_map = last.position_fingerprint == fingerprint_;
  text_ =
      fmt::format("{}, where the last real-time task left it{}{}{}", degrees(profile_.arm, at.position_rad),
                  is_same_map ? "" : ", by its last pulses: THE SERVO MAP HAS CHANGED",
                  was_unpowered_ ? ", with the servos unpowered since" : "", slow_note(true));
  return {at.position_rad, at.opening, true};
}

StartPosition::Saved StartPosition::read() const {
  if (!store_) {
    spdlog::warn("no directory for the last position: set CORBOT_STATE_DIR or HOME, or give --state-dir");
    return {};
  }
  try {
    const std::optional<LastPosition> position = store_->load(profile_.arm);
    return {position, position && position->held};
  } catch (const PositionError& error) {
    spdlog::warn("the last position is rejected: {}{}", error.what(),
                 error.held() ? "; the arm is still held by a StopAndHold" : "");
    return {std::nullopt, error.held()};
  }
}

std::optional<CycleStart> StartPosition::from_device(const DevicePosition& device,
                                                     const std::optional<LastPosition>& saved) {
  if (device.kind == DevicePosition::Kind::kUnknown) return std::nullopt;
  // A controller may go on sending to servos that have no power.
  const bool is_unpowered = device.kind == DevicePosition::Kind::kCommanded && was_unpowered_;
  CycleStart start{device.position_rad, device.opening, is_unpowered};
  if (device.opening < 0.0) start.opening = saved ? saved->opening : 0.0;
  if (!is_in_range(profile_.arm, start.position_rad, kNearRange_rad)) {
    spdlog::warn("the device reports the arm at {}, outside its range: rejected",
                 degrees(profile_.arm, start.position_rad));
    return std::nullopt;
  }
  bool is_same = saved.has_value() && device.kind == DevicePosition::Kind::kCommanded;
  for (std::size_t i = 0; i < profile_.arm.dof; ++i) {
    const JointLimits& limits = profile_.arm.joints[i];
    start.position_rad[i] = std::clamp(start.position_rad[i], limits.lower_rad, limits.upper_rad);
    is_same = is_same && std::abs(saved->position_rad[i] - start.position_rad[i]) <= kSamePulse_rad;
  }
  if (is_same) start = {saved->position_rad, saved->opening, is_unpowered};  // the same, unrounded
  text_ = fmt::format("{}, {}{}", degrees(profile_.arm, start.position_rad),
                      device.kind == DevicePosition::Kind::kMeasured ? "measured by the device"
                                                                     : "by the pulses that the device sends",
                      slow_note(is_unpowered));
  return start;
}

CycleStart StartPosition::assumed(const std::optional<LastPosition>& saved) {
  CycleStart start;
  start.unverified = !profile_.backend.position_known_at_start;
  if (saved) {
    start.position_rad = saved->position_rad;
    start.opening = saved->opening;
    text_ = fmt::format("{}, where corbot left it at {}{}{}{}", degrees(profile_.arm, start.position_rad),
                        utc_text(saved->saved_s),
                        saved->boot_id == boot_id() ? "" : ", before this machine was started",
                        saved->at_rest ? "" : ", IN THE MIDDLE OF A MOTION", slow_note(start.unverified));
    return start;
  }
  text_ = fmt::format("{}0 degrees{}", start.unverified ? "UNKNOWN; the arm is taken to be at " : "",
                      slow_note(start.unverified));
  return start;
}

void StartPosition::save(const TaskSegment& segment) const {
  Snapshot last{};
  if (!store_ || !last_snapshot(segment, last)) return;
  try {
    store_->save(position_of(last, robot_), profile_.arm.dof);
  } catch (const std::exception& error) {
    spdlog::warn("the last position is not saved: {}", error.what());
  }
}

}  // namespace corbot::rt
