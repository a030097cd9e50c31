// SPDX-License-Identifier: Apache-2.0
#include "rt/start_position.h"

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "rt/set_point_check.h"

namespace corbot::rt {
namespace {

constexpr double kDegree = std::numbers::pi / 180.0;
/// A controller tells its pulses in steps of up to 10 us, 1 degree of a usual servo.
constexpr double kSamePulse_rad = 2.0 * kDegree;
/// A joint may hang that far beyond its end; it is brought back, slowly.
constexpr double kNearRange_rad = 3.0 * kDegree;

std::string degrees(const ArmModel& arm, const Joints& position_rad) {
  std::string text;
  for (std::size_t i = 0; i < arm.dof; ++i) {
    text += fmt::format("{}{:.1f}", i == 0 ? "" : " ", position_rad[i] / kDegree + 0.0);
  }
  return text + " degrees";
}

const char* slow_note(bool uncertain) {
  return uncertain ? "; believed, not known: the first motion runs at 10 % of its speed" : "";
}

}  // namespace

StartPosition::StartPosition(const Profile& profile, const std::string& robot,
                             const std::string& state_directory)
    : profile_(profile), robot_(robot) {
  const std::filesystem::path directory =
      state_directory.empty() ? default_state_directory() : std::filesystem::path(state_directory);
  if (!directory.empty()) store_.emplace(directory, robot, "rt");
}

CycleStart StartPosition::find(const SegmentLayout& segment, const DevicePosition& device, bool forget) {
  Snapshot last{};
  if (last_snapshot(segment, last) && is_in_range(profile_.arm, last.position_rad, kGateTolerance_rad)) {
    text_ = fmt::format("where the last real-time task left it{}",
                        slow_note((last.flags & kSnapshotUncertain) != 0));
    return {last.position_rad, last.gripper, (last.flags & kSnapshotUncertain) != 0};
  }
  const std::optional<LastPosition> kept = forget ? std::nullopt : read();
  const std::optional<CycleStart> told = from_device(device, kept);
  const CycleStart start = told ? *told : believed(kept);
  spdlog::log(start.uncertain ? spdlog::level::warn : spdlog::level::info, "position: {}", text_);
  return start;
}

std::optional<LastPosition> StartPosition::read() const {
  if (!store_) {
    spdlog::warn("no directory for the last position: set CORBOT_STATE_DIR or HOME, or give --state-dir");
    return std::nullopt;
  }
  try {
    return store_->load(profile_.arm);
  } catch (const PositionError& error) {
    spdlog::warn("the last position is not believed: {}", error.what());
    return std::nullopt;
  }
}

std::optional<CycleStart> StartPosition::from_device(const DevicePosition& device,
                                                     const std::optional<LastPosition>& kept) {
  if (device.kind == DevicePosition::Kind::kUnknown) return std::nullopt;
  CycleStart start{device.position_rad, device.opening, false};
  if (device.opening < 0.0) start.opening = kept ? kept->opening : 0.0;
  if (!is_in_range(profile_.arm, start.position_rad, kNearRange_rad)) {
    spdlog::warn("the device says that the arm is at {}, outside its range: not believed",
                 degrees(profile_.arm, start.position_rad));
    return std::nullopt;
  }
  bool is_same = kept.has_value() && device.kind == DevicePosition::Kind::kTold;
  for (std::size_t i = 0; i < profile_.arm.dof; ++i) {
    const JointLimits& limits = profile_.arm.joints[i];
    start.position_rad[i] = std::clamp(start.position_rad[i], limits.lower_rad, limits.upper_rad);
    is_same = is_same && std::abs(kept->position_rad[i] - start.position_rad[i]) <= kSamePulse_rad;
  }
  if (is_same) start = {kept->position_rad, kept->opening, false};  // the same, and not rounded
  text_ = fmt::format("{}, {}", degrees(profile_.arm, start.position_rad),
                      device.kind == DevicePosition::Kind::kMeasured ? "measured by the device"
                                                                     : "by the pulses that the device sends");
  return start;
}

CycleStart StartPosition::believed(const std::optional<LastPosition>& kept) {
  CycleStart start;
  start.uncertain = !profile_.backend.position_known_at_start;
  if (kept) {
    start.position_rad = kept->position_rad;
    start.opening = kept->opening;
    text_ = fmt::format("{}, where corbot left it at {}{}{}{}", degrees(profile_.arm, start.position_rad),
                        utc_text(kept->saved_s),
                        kept->boot_id == boot_id() ? "" : ", before this machine was started",
                        kept->at_rest ? "" : ", IN THE MIDDLE OF A MOTION", slow_note(start.uncertain));
    return start;
  }
  text_ = fmt::format("{}0 degrees{}",
                      start.uncertain ? "NOBODY KNOWS WHERE THE ARM IS; it is taken to be at " : "",
                      slow_note(start.uncertain));
  return start;
}

void StartPosition::keep(const SegmentLayout& segment) const {
  Snapshot last{};
  if (!store_ || !last_snapshot(segment, last)) return;
  try {
    store_->save(position_of(last, robot_, profile_.arm), profile_.arm.dof);
  } catch (const std::exception& error) {
    spdlog::warn("the last position is not kept: {}", error.what());
  }
}

}  // namespace corbot::rt
