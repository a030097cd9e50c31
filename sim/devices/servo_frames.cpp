// SPDX-License-Identifier: Apache-2.0
#include "sim/devices/servo_frames.h"

namespace corbot::sim {
namespace {

/// After a longer silence the frames before the last minute are skipped: the servos have long settled.
constexpr std::int64_t kMostFrames = 3000;

}  // namespace

ServoFrames::ServoFrames(std::size_t channels, const ServoModelOptions& servo, double shaft_us)
    : servo_(servo), outputs_(channels, Output{0.0, ServoModel(servo, shaft_us)}) {}

void ServoFrames::advance(std::int64_t now_ns, const PulseAt& pulse_at) {
  const std::int64_t latest_ns = now_ns - now_ns % kServoFrame_ns;
  if (!has_begun_) {
    has_begun_ = true;
    frame_ns_ = latest_ns;
    send_frame(pulse_at);
  }
  const std::int64_t skipped_ns = latest_ns - frame_ns_ - kMostFrames * kServoFrame_ns;
  if (skipped_ns > 0) {
    pass(static_cast<double>(skipped_ns) * 1e-9);
    frame_ns_ += skipped_ns;
  }
  while (frame_ns_ < latest_ns) {
    pass(static_cast<double>(kServoFrame_ns) * 1e-9);
    frame_ns_ += kServoFrame_ns;
    send_frame(pulse_at);
  }
}

void ServoFrames::send_frame(const PulseAt& pulse_at) {
  for (std::size_t i = 0; i < outputs_.size(); ++i) {
    Output& output = outputs_[i];
    const double before_us = output.pulse_us;
    output.pulse_us = pulse_at(i, frame_ns_);
    if (output.pulse_us > 0.0) {
      output.servo.set_pulse(output.pulse_us);
    } else if (before_us > 0.0) {
      // A servo drops the pulse that it followed; otherwise its dead band could bring that pulse back.
      output.servo = ServoModel(servo_, output.servo.position_us());
    }
  }
}

void ServoFrames::stop() {
  for (Output& output : outputs_) {
    output.pulse_us = 0.0;
    output.servo = ServoModel(servo_, output.servo.position_us());
  }
}

void ServoFrames::pass(double dt_s) {
  for (Output& output : outputs_) {
    if (output.pulse_us > 0.0) output.servo.step(dt_s);
  }
}

double ServoFrames::pulse_us(std::size_t channel) const {
  return channel < outputs_.size() ? outputs_[channel].pulse_us : 0.0;
}

double ServoFrames::shaft_us(std::size_t channel, std::int64_t now_ns) const {
  if (channel >= outputs_.size()) return 0.0;
  const Output& output = outputs_[channel];
  ServoModel servo = output.servo;
  if (output.pulse_us > 0.0) servo.step(static_cast<double>(now_ns - frame_ns_) * 1e-9);
  return servo.position_us();
}

}  // namespace corbot::sim
