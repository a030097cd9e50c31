// SPDX-License-Identifier: Apache-2.0
#include "rt/backends/loopback/loopback_backend.h"

#include <algorithm>

#include "rt/backends/bus/approach_speed.h"

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
  next_frame_ns_ = 0;
  last_us_ = first.pulse_us;
  is_back_.store(false);
  health_.store(BackendHealth::kOpen);
}

void LoopbackBackend::close() noexcept {
  signals_.reset();
  health_.store(BackendHealth::kClosed);
}

void LoopbackBackend::set_plugged(bool plugged) noexcept {
  is_back_.store(plugged && health() == BackendHealth::kLost);
  if (!plugged) health_.store(BackendHealth::kLost);
}

bool LoopbackBackend::ramp_to(ServoFrame& frame, double dt_s) const noexcept {
  const double most_us = frame.emergency_stop ? 0.0 : kApproach_us_per_s * dt_s;
  bool is_there = true;
  for (std::size_t i = 0; i < std::min<std::size_t>(frame.servo_count, kMaxServos); ++i) {
    const double step_us = std::clamp(frame.pulse_us[i] - last_us_[i], -most_us, most_us);
    is_there = is_there && last_us_[i] + step_us == frame.pulse_us[i];
    frame.pulse_us[i] = last_us_[i] + step_us;
  }
  return is_there;
}

void LoopbackBackend::write(const ServoFrame& frame) noexcept {
  const BackendHealth now = health();
  const bool is_back = is_back_.load(std::memory_order_relaxed);
  if (now == BackendHealth::kClosed || (now == BackendHealth::kLost && !is_back)) return;
  if (frame_count_ > 0 && frame.time_ns < next_frame_ns_) return;
  const double dt_s = frame_count_ > 0 ? static_cast<double>(frame.time_ns - last_frame_ns_) * 1e-9 : 0.0;
  ServoFrame given = frame;
  if (is_back && ramp_to(given, static_cast<double>(frame_period_ns_) * 1e-9)) {
    is_back_.store(false, std::memory_order_relaxed);
    health_.store(BackendHealth::kOpen, std::memory_order_release);
  }
  take_frame(given, std::max(dt_s, 0.0));
  // On the grid of the first frame; after a pause of the loop on from now, not a burst.
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
    servos_[i].step(dt_s);  // towards the pulse of the frame before
    servos_[i].set_pulse(frame.pulse_us[i]);
    record.servo_us[i] = servos_[i].position_us();
  }
  ++frame_count_;
}

ServoFeedback LoopbackBackend::read() noexcept {
  ServoFeedback feedback;
  const BackendHealth now = health();
  const bool is_there = now == BackendHealth::kOpen || now == BackendHealth::kDegraded;
  feedback.measured = settings_.readback && is_there && frame_count_ > 0;
  if (!feedback.measured) return feedback;
  feedback.time_ns = last_frame_ns_;
  for (std::size_t i = 0; i < std::min<std::size_t>(arm_.dof, kMaxJoints); ++i) {
    const ServoMap& map = arm_.servos[i];
    feedback.position_rad[i] = (servos_[i].position_us() - map.zero_us) / (map.direction * map.us_per_rad);
  }
  return feedback;
}

}  // namespace corbot::rt
