// SPDX-License-Identifier: Apache-2.0
#include "rt/backends/loopback/loopback_backend.h"

#include <algorithm>

namespace corbot::rt {

LoopbackBackend::LoopbackBackend(const ArmModel& arm, const LoopbackSettings& settings)
    : arm_(arm),
      settings_(settings),
      frame_period_ns_(static_cast<std::int64_t>(1e9 / settings.frame_hz)),
      recorded_(kRecordedFrames) {}

void LoopbackBackend::open(const ServoFrame& first) {
  for (std::size_t i = 0; i < kMaxServos; ++i)
    servos_[i] = sim::ServoModel(settings_.servo, first.pulse_us[i]);
  frame_count_ = 0;
  newest_cycle_ = 0;
  next_frame_ns_ = 0;
  last_us_ = first.pulse_us;
  ramps_ = {};
  is_back_.store(false);
  health_.store(first.needs_clear ? BackendHealth::kStandby : BackendHealth::kOpen);
}

void LoopbackBackend::close() noexcept {
  signals_.reset();
  health_.store(BackendHealth::kClosed);
}

void LoopbackBackend::set_plugged(bool plugged) noexcept {
  is_back_.store(plugged && health() == BackendHealth::kLost);
  if (!plugged) health_.store(BackendHealth::kLost);
}

/// Advances the health. A frame that needs a Clear answers a loss. If the servos are there already, nothing
/// is approached.
BackendHealth LoopbackBackend::follow(const ServoFrame& frame) noexcept {
  if (frame.needs_clear) {
    if (is_back_.exchange(false) && change(BackendHealth::kLost, BackendHealth::kStandby)) ramps_ = {};
  } else if (health() == BackendHealth::kStandby && is_at(frame)) {
    (void)change(BackendHealth::kStandby, BackendHealth::kOpen);
  }
  return health();
}

bool LoopbackBackend::is_at(const ServoFrame& frame) const noexcept {
  const auto count = static_cast<std::ptrdiff_t>(std::min<std::size_t>(frame.servo_count, kMaxServos));
  return std::equal(frame.pulse_us.begin(), frame.pulse_us.begin() + count, last_us_.begin()) &&
         std::all_of(ramps_.begin(), ramps_.end(), [](const ApproachRamp& ramp) { return ramp.rests(); });
}

bool LoopbackBackend::approach(ServoFrame& frame) noexcept {
  const double dt_s = static_cast<double>(frame_period_ns_) * 1e-9;
  bool is_there = !frame.needs_clear;
  for (std::size_t i = 0; i < kMaxServos; ++i) {
    const double target_us = frame.pulse_us[i];
    frame.pulse_us[i] = last_us_[i];
    if (frame.needs_clear || i >= frame.servo_count) {
      (void)ramps_[i].halt(frame.pulse_us[i], pulse_limits(arm_, i), dt_s);
    } else {
      is_there &= ramps_[i].step(frame.pulse_us[i], target_us, pulse_limits(arm_, i), dt_s);
    }
  }
  return is_there;
}

void LoopbackBackend::write(const ServoFrame& frame) noexcept {
  const BackendHealth now = follow(frame);
  if (now == BackendHealth::kClosed || now == BackendHealth::kLost) return;
  const bool is_standing_by = now == BackendHealth::kStandby;
  if (!is_standing_by) newest_cycle_ = frame.cycle;
  if (frame_count_ > 0 && frame.time_ns < next_frame_ns_) return;
  const double dt_s = frame_count_ > 0 ? static_cast<double>(frame.time_ns - last_frame_ns_) * 1e-9 : 0.0;
  ServoFrame given = frame;
  if (is_standing_by && approach(given)) (void)change(BackendHealth::kStandby, BackendHealth::kOpen);
  take_frame(given, std::max(dt_s, 0.0));
  // Stays on the grid of the first frame; after a pause of the loop it continues from now, without a burst.
  const bool is_late = frame_count_ == 1 || frame.time_ns >= next_frame_ns_ + frame_period_ns_;
  next_frame_ns_ = (is_late ? frame.time_ns : next_frame_ns_) + frame_period_ns_;
  last_frame_ns_ = frame.time_ns;
}

void LoopbackBackend::take_frame(const ServoFrame& frame, double dt_s) noexcept {
  RecordedFrame& record = recorded_[frame_count_ % kRecordedFrames];
  record.cycle = frame.cycle;
  record.time_ns = frame.time_ns;
  record.pulse_us = frame.pulse_us;
  last_us_ = frame.pulse_us;
  const std::size_t count = std::min<std::size_t>(frame.servo_count, kMaxServos);
  for (std::size_t i = 0; i < count; ++i) {
    servos_[i].step(dt_s);  // towards the pulse of the previous frame
    servos_[i].set_pulse(frame.pulse_us[i]);
    record.servo_us[i] = servos_[i].position_us();
  }
  ++frame_count_;
}

ServoFeedback LoopbackBackend::read() noexcept {
  ServoFeedback feedback;
  const BackendHealth now = health();
  if (now == BackendHealth::kClosed || now == BackendHealth::kLost) return feedback;
  feedback.measured = settings_.readback && frame_count_ > 0;
  feedback.commanded = !feedback.measured && now == BackendHealth::kStandby;
  feedback.time_ns = last_frame_ns_;
  for (std::size_t i = 0; i < std::min<std::size_t>(arm_.dof, kMaxJoints); ++i) {
    const ServoMap& map = arm_.servos[i];
    const double at_us = feedback.measured ? servos_[i].position_us() : last_us_[i];
    if (feedback.measured || feedback.commanded)
      feedback.position_q[i] = (at_us - map.zero_us) / (map.direction * map.us_per_q);
  }
  return feedback;
}

}  // namespace corbot::rt
