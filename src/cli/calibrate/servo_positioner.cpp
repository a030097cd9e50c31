// SPDX-License-Identifier: Apache-2.0
#include "cli/calibrate/servo_positioner.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <stdexcept>
#include <thread>
#include <utility>

#include "rt/backends/registry.h"
#include "rt/cycle/servo_map.h"
#include "rt/safety_settings.h"

namespace corbot::cli {

namespace {

using Clock = std::chrono::steady_clock;

constexpr std::chrono::milliseconds kStep{20};  // period of a servo's frames
constexpr double kGripperLowest_us = 500.0;
constexpr double kGripperHighest_us = 2500.0;

}  // namespace

ServoPositioner::ServoPositioner(const Profile& profile, const std::atomic<bool>& end)
    : profile_(profile),
      end_(end),
      backend_(rt::make_backend(profile, stop_)),
      safety_(rt::safety_settings(profile), rt::kernel_gpio(), stop_, [this] {
        // There is no cycle: on a stop the arm is at rest at once, and only the device's thread can stall.
        return rt::CycleView{.cycle = ++looks_,
                             .in_error = is_stopped(),
                             .power_off = is_stopped(),
                             .bus_beats = backend_->beats()};
      }) {}

void ServoPositioner::close() noexcept {
  safety_.stop();
  backend_->close();
}

std::vector<LogLine> ServoPositioner::drain_log() {
  std::vector<LogLine> lines = safety_.drain_log();
  for (LogLine& line : backend_->drain_log()) lines.push_back(std::move(line));
  return lines;
}

void ServoPositioner::connect(const Joints* kept_q, double kept_opening) {
  const DevicePosition device = backend_->connect();
  Joints position_q{};
  double opening = 0.0;
  origin_ = "SERVO POSITIONS UNKNOWN; angle 0 of the profile is assumed";
  if (device.kind != DevicePosition::Kind::kUnknown) {
    position_q = device.position_q;
    opening = std::max(device.opening, 0.0);
    origin_ = "servo positions are read from the device";
  } else if (kept_q != nullptr) {
    position_q = *kept_q;
    opening = kept_opening;
    is_stored_ = true;
    origin_ = "servo positions are the stored ones, where corbot left the arm";
  }
  if (profile_.backend.kind == "loopback") origin_ = "this is the simulator: no real servo is measured";
  rt::map_to_pulses(profile_.arm, position_q, opening, frame_);
}

void ServoPositioner::switch_on() {
  if (!is_on_) {
    safety_.start();
    if (end_) throw std::runtime_error("the command was ended before the servos had their pulses");
    if (stop_.sources() != 0) throw std::runtime_error("the emergency stop is pressed: release it first");
    presses_seen_ = stop_.presses();
    frame_.time_ns = Clock::now().time_since_epoch().count();
    backend_->open(frame_);
    safety_.allow_power();
    is_on_ = true;
  }
  if (stop_.sources() != 0) throw std::runtime_error("the emergency stop is pressed: release it first");
  presses_seen_ = stop_.presses();
  send();
}

double ServoPositioner::lowest_us(std::size_t servo) const {
  return servo < profile_.arm.dof ? profile_.arm.servos[servo].pulse_min_us : kGripperLowest_us;
}

double ServoPositioner::highest_us(std::size_t servo) const {
  return servo < profile_.arm.dof ? profile_.arm.servos[servo].pulse_max_us : kGripperHighest_us;
}

bool ServoPositioner::go(std::size_t servo, double pulse_us) {
  const double target_us = std::clamp(pulse_us, lowest_us(servo), highest_us(servo));
  const double most_us = kSpeed_us_per_s * std::chrono::duration<double>(kStep).count();
  auto due = Clock::now();
  while (!end_ && !is_lost()) {
    if (is_stopped()) return false;
    double& at_us = frame_.pulse_us[servo];
    at_us += std::clamp(target_us - at_us, -most_us, most_us);
    send();
    due += kStep;
    std::this_thread::sleep_until(due);
    if (at_us == target_us) return true;
  }
  return false;
}

bool ServoPositioner::is_lost() const {
  const BackendHealth health = backend_->health();
  return is_on_ && (health == BackendHealth::kLost || health == BackendHealth::kClosed);
}

void ServoPositioner::send() {
  ++frame_.cycle;
  frame_.time_ns = Clock::now().time_since_epoch().count();
  for (std::size_t i = 0; i < profile_.arm.dof; ++i) {
    const ServoMap& map = profile_.arm.servos[i];
    frame_.position_q[i] = (frame_.pulse_us[i] - map.zero_us) / (map.direction * map.us_per_q);
  }
  backend_->write(frame_);
}

}  // namespace corbot::cli
