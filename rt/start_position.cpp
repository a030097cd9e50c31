// SPDX-License-Identifier: Apache-2.0
#include "rt/start_position.h"

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "corbot/arm/joint_units.h"
#include "corbot/motion/bounds.h"
#include "rt/cycle/set_point_check.h"

namespace corbot::rt {
namespace {

/// A controller reports its pulses in steps of up to 10 us, 1 degree of a usual servo.
constexpr double kSamePulse_rad = to_radians(2.0);

/// The greatest distance of a measured joint from the last task's set-point at which the set-point still
/// counts. A drive is off by its static lag, a degree or so under load. If every restart began at the
/// measured position, the arm would sink by the lag each time. The bound is below the distance that an
/// approach corrects anyway (Approach::kMostTurned_rad). A joint further away was moved.
constexpr double kMostLag_rad = to_radians(2.0);

/// Returns "12.3" for a joint that turns, "0.0123" for one that slides.
std::string number_text(JointKind kind, double value_q) {
  return fmt::format("{:.{}f}", to_shown(kind, value_q) + 0.0, decimals(kind, 1));
}

std::string range_text(JointKind kind, const alarm::OutOfRange& beyond) {
  return number_text(kind, beyond.lower_q) + " to " + number_text(kind, beyond.upper_q);
}

/// Returns "0.0 90.0 degrees"; if joints slide, each value has its unit: "0.0 degrees, 0.1000 m".
std::string joints_text(const ArmModel& arm, const Joints& position_q) {
  const JointKinds kinds = kinds_of(arm.kinematics.chain());
  const auto end = kinds.begin() + static_cast<std::ptrdiff_t>(arm.dof);
  const bool all_turn = std::all_of(kinds.begin(), end, [](JointKind k) { return k == JointKind::kRotary; });
  std::string text;
  for (std::size_t i = 0; i < arm.dof; ++i) {
    text += (i == 0 ? "" : all_turn ? " " : ", ") + number_text(kinds[i], position_q[i]);
    if (!all_turn || i + 1 == arm.dof) text += std::string(" ") + unit_name(kinds[i]);
  }
  return text;
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
  if (!directory.empty()) store_.emplace(directory, robot, profile.backend.kind, "rt");
}

CycleStart StartPosition::find(const TaskSegment& segment, const DevicePosition& device, bool forget) {
  refuse_impossible(device);
  CycleStart start = decide(segment, device, forget);
  start.position_known = profile_.backend.position_known_at_start;
  start.position_fingerprint = fingerprint_;
  spdlog::log(start.unverified ? spdlog::level::warn : spdlog::level::info, "position: {}", text_);
  return start;
}

void StartPosition::refuse_impossible(const DevicePosition& device) const {
  if (device.kind == DevicePosition::Kind::kUnknown) return;
  const bool is_measured = device.kind == DevicePosition::Kind::kMeasured;
  const auto beyond = beyond_range(profile_.arm, device.position_q,
                                   is_measured ? kNearRangeMeasured_rad : kNearRangeCommanded_rad);
  if (!beyond) return;
  const auto joint = static_cast<std::size_t>(beyond->joint);
  const std::string& name = profile_.joint_names[joint];
  const JointKind kind = profile_.arm.kinematics.joint_kind(joint);
  const bool turns = kind == JointKind::kRotary;
  const std::string at = number_text(kind, beyond->position_q) + " " + unit_name(kind);
  const std::string range = range_text(kind, *beyond);
  if (is_measured) {
    throw std::runtime_error(fmt::format(
        "joint {} is measured at {}, outside its range of {}: not started. Home its encoder, correct its "
        "drive's zero_count, {} or direction, or {} it by hand into its range",
        name, at, range, turns ? "counts_per_degree" : "counts_per_m", turns ? "turn" : "push"));
  }
  const ServoMap& servo = profile_.arm.servos[joint];
  throw std::runtime_error(fmt::format(
      "joint {} is at {}, outside its range of {}; the controller sends its servo a pulse of {:.0f} us. "
      "Every "
      "start would move the joint, so the task has not started. Correct zero_us, {}, direction or {} in the "
      "profile if they are wrong. Else move the joint into its range with 'corbot calibrate', or hold the "
      "arm and switch controller and servos off and on",
      name, at, range, servo.zero_us + servo.direction * servo.us_per_q * beyond->position_q,
      turns ? "us_per_degree" : "us_per_mm", turns ? "range_deg" : "range_m"));
}

/// Refuses a start that would move a joint; no device contradicts the position, and the servos have had power
/// since.
void StartPosition::refuse_impossible(const Snapshot& last) const {
  if (last.position_fingerprint == fingerprint_ || was_unpowered_) return;
  const auto beyond = beyond_range(profile_.arm, joints_of(last), kNearRangeCommanded_rad);
  if (!beyond) return;
  const auto joint = static_cast<std::size_t>(beyond->joint);
  const JointKind kind = profile_.arm.kinematics.joint_kind(joint);
  throw std::runtime_error(fmt::format(
      "joint {} is at {} {}, outside its range of {}. The previous task's last pulse is {:.0f} us, and the "
      "servo map has changed since. Every start would move the joint, so the task has not started. Correct "
      "zero_us, {} or direction in the profile. Or start with --fresh, with the servos off or the arm held",
      profile_.joint_names[joint], number_text(kind, beyond->position_q), unit_name(kind),
      range_text(kind, *beyond), last.pulse_us[joint],
      kind == JointKind::kRotary ? "us_per_degree" : "us_per_mm"));
}

CycleStart StartPosition::decide(const TaskSegment& segment, const DevicePosition& device, bool forget) {
  Snapshot last{};
  const bool has_snapshot = last_snapshot(segment, last);
  const bool has_last = has_snapshot && is_in_range(profile_.arm, last.position_q, kGateTolerance_q);
  const bool is_of_this_map = has_last && last.position_fingerprint == fingerprint_ && !was_unpowered_;
  const std::string moved = is_of_this_map ? moved_since(last, device) : "";
  if (is_of_this_map && moved.empty()) {
    text_ = fmt::format("where the last real-time task left it{}",
                        slow_note((last.flags & kSnapshotUnverified) != 0));
    return {last.position_q, last.gripper, (last.flags & kSnapshotUnverified) != 0};
  }
  const Saved file = has_last || forget ? Saved{} : read();
  const std::optional<LastPosition> saved = has_last ? by_pulses(last) : file.position;
  const std::optional<CycleStart> reported = from_device(device, saved);
  if (!reported && has_last) refuse_impossible(last);
  CycleStart start = reported ? *reported : has_last ? left_by(last, *saved) : assumed(saved);
  start.in_error = file.in_error;
  start.was_moved = !moved.empty();
  if (!moved.empty()) text_ += moved + "; in Error until Clear";
  if (!file.damage.empty()) text_ += "; in Error until Clear: " + file.damage;
  start.held = file.held || (has_snapshot && (last.flags & kSnapshotHeld) != 0);
  start.outranks_segment = true;
  return start;
}

/// Describes how far a joint was moved since the last task. Drives that lose their energy with their task let
/// the arm sag, or be turned by hand. Driven back, the arm would move without a Clear; energised anew, it
/// would also be so without one. Empty: no joint is further away than the lag of a joint at rest.
std::string StartPosition::moved_since(const Snapshot& last, const DevicePosition& device) const {
  if (device.kind != DevicePosition::Kind::kMeasured) return "";
  const JointKinds kinds = kinds_of(profile_.arm.kinematics.chain());
  std::size_t furthest = 0;
  const auto away_q = [&](std::size_t joint) {
    return std::abs(device.position_q[joint] - last.position_q[joint]);
  };
  const auto share = [&](std::size_t joint) { return away_q(joint) / near_q(kinds[joint], kMostLag_rad); };
  for (std::size_t i = 1; i < profile_.arm.dof; ++i) {
    if (share(i) > share(furthest)) furthest = i;
  }
  if (share(furthest) <= 1.0) return "";
  return fmt::format(", {} {} from where the last real-time task left joint {}",
                     number_text(kinds[furthest], away_q(furthest)), unit_name(kinds[furthest]),
                     profile_.joint_names[furthest]);
}

/// Returns the joints of the last pulses, by the present servo map.
Joints StartPosition::joints_of(const Snapshot& last) const {
  Joints position_q{};
  for (std::size_t i = 0; i < profile_.arm.dof; ++i) {
    const ServoMap& map = profile_.arm.servos[i];
    position_q[i] = (last.pulse_us[i] - map.zero_us) / (map.direction * map.us_per_q);
  }
  return position_q;
}

/// Returns the position by the last pulses: the servos are at their pulses, whatever these mean by now.
LastPosition StartPosition::by_pulses(const Snapshot& last) const {
  LastPosition position = position_of(last, robot_, profile_.backend.kind);
  if (last.position_fingerprint == fingerprint_) return position;
  const ArmModel& arm = profile_.arm;
  const Joints mapped_q = joints_of(last);
  for (std::size_t i = 0; i < arm.dof; ++i) {
    const double at_q = mapped_q[i];
    position.position_q[i] =
        std::isfinite(at_q) ? std::clamp(at_q, arm.joints[i].lower_q, arm.joints[i].upper_q) : 0.0;
  }
  const double opening =
      (last.pulse_us[arm.dof] - arm.gripper.closed_us) / (arm.gripper.open_us - arm.gripper.closed_us);
  position.opening = std::isfinite(opening) ? std::clamp(opening, 0.0, 1.0) : 0.0;
  return position;
}

CycleStart StartPosition::left_by(const Snapshot& last, const LastPosition& at) {
  const bool is_same_map = last.position_fingerprint == fingerprint_;
  text_ =
      fmt::format("{}, where the last real-time task left it{}{}{}", joints_text(profile_.arm, at.position_q),
                  is_same_map ? "" : ", by its last pulses: THE SERVO MAP HAS CHANGED",
                  was_unpowered_ ? ", with the servos unpowered since" : "", slow_note(true));
  return {at.position_q, at.opening, true};
}

StartPosition::Saved StartPosition::read() const {
  if (!store_) {
    spdlog::warn("no directory for the last position: set CORBOT_STATE_DIR or HOME, or give --state-dir");
    return {};
  }
  try {
    const std::optional<LastPosition> position = store_->load(profile_.arm);
    if (position && position->in_error)
      spdlog::warn("the arm was in Error and was not cleared: the task energises nothing until Clear");
    return {position, position && position->held, position && position->in_error, {}};
  } catch (const PositionError& error) {
    spdlog::warn("the file of the last position is rejected: {}{}", error.what(),
                 error.held()       ? "; the arm is still held by a StopAndHold"
                 : error.in_error() ? "; the arm is in Error until Clear"
                                    : "");
    return {std::nullopt, error.held(), error.in_error(), error.in_error() ? error.what() : ""};
  }
}

std::optional<CycleStart> StartPosition::from_device(const DevicePosition& device,
                                                     const std::optional<LastPosition>& saved) {
  if (device.kind == DevicePosition::Kind::kUnknown) return std::nullopt;
  // A controller may continue sending to servos that have no power.
  const bool is_unpowered = device.kind == DevicePosition::Kind::kCommanded && was_unpowered_;
  CycleStart start{device.position_q, device.opening, is_unpowered};
  if (!(device.opening >= 0.0)) start.opening = saved ? saved->opening : 0.0;
  bool is_same = saved.has_value() && device.kind == DevicePosition::Kind::kCommanded;
  for (std::size_t i = 0; i < profile_.arm.dof; ++i) {
    const JointLimits& limits = profile_.arm.joints[i];
    start.position_q[i] = std::clamp(start.position_q[i], limits.lower_q, limits.upper_q);
    is_same = is_same && std::abs(saved->position_q[i] - start.position_q[i]) <=
                             near_q(profile_.arm.kinematics.joint_kind(i), kSamePulse_rad);
  }
  if (is_same) start = {saved->position_q, saved->opening, is_unpowered};  // the same, unrounded
  text_ = fmt::format("{}, {}{}", joints_text(profile_.arm, start.position_q),
                      device.kind == DevicePosition::Kind::kMeasured ? "measured by the device"
                                                                     : "by the pulses that the device sends",
                      slow_note(is_unpowered));
  return start;
}

CycleStart StartPosition::assumed(const std::optional<LastPosition>& saved) {
  CycleStart start;
  start.unverified = !profile_.backend.position_known_at_start;
  if (saved) {
    start.position_q = saved->position_q;
    start.opening = saved->opening;
    text_ = fmt::format("{}, where corbot left it at {}{}{}{}", joints_text(profile_.arm, start.position_q),
                        utc_text(saved->saved_s),
                        saved->boot_id == boot_id() ? "" : ", before this machine was started",
                        saved->at_rest ? "" : ", IN THE MIDDLE OF A MOTION", slow_note(start.unverified));
    return start;
  }
  text_ = fmt::format("{}0 in all joints{}", start.unverified ? "UNKNOWN; the arm is taken to be at " : "",
                      slow_note(start.unverified));
  return start;
}

void StartPosition::save(const TaskSegment& segment) const {
  Snapshot last{};
  if (!store_ || !last_snapshot(segment, last)) return;
  try {
    store_->save(position_of(last, robot_, profile_.backend.kind), profile_.arm);
  } catch (const std::exception& error) {
    spdlog::warn("the last position is not saved: {}", error.what());
  }
}

}  // namespace corbot::rt
