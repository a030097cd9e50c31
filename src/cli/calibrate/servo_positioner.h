// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <cstdint>
#include <memory>
#include <string>

#include "config/profile.h"
#include "corbot/backend/backend.h"
#include "corbot/backend/emergency_stop.h"
#include "rt/inputs/safety_lines.h"

namespace corbot::cli {

/// The servos of a profile by their pulses, one after the other, slowly; what corbot-rt does otherwise. For
/// `corbot calibrate`. One thread.
class ServoPositioner {
 public:
  static constexpr double kSpeed_us_per_s = 200.0;

  /// `end`: asked for between steps.
  ServoPositioner(const Profile& profile, const std::atomic<bool>& end);
  ServoPositioner(const ServoPositioner&) = delete;
  ServoPositioner& operator=(const ServoPositioner&) = delete;
  /// Holds or relaxes, as the profile wants it.
  ~ServoPositioner();

  /// Opens the device; no servo gets a pulse yet. `kept` is where the last position was, for a device that
  /// cannot say where its servos are. Throws std::runtime_error.
  void connect(const Joints* kept_rad, double kept_opening);
  /// By whose word pulse_us() is where it is.
  [[nodiscard]] const std::string& origin() const noexcept { return origin_; }
  /// Gives every servo the pulse at which it is believed to be, and power where that is switched; again after
  /// an emergency stop. Throws std::runtime_error, also while that is pressed.
  void switch_on();
  [[nodiscard]] bool is_on() const noexcept { return is_on_; }

  /// Index of the frame: the joints, then the gripper.
  [[nodiscard]] std::size_t servos() const noexcept { return frame_.servo_count; }
  [[nodiscard]] double pulse_us(std::size_t servo) const { return frame_.pulse_us[servo]; }
  [[nodiscard]] double lowest_us(std::size_t servo) const;
  [[nodiscard]] double highest_us(std::size_t servo) const;
  /// To a pulse within these bounds, at kSpeed_us_per_s; returns when it is there. False when the end was
  /// asked for, at an emergency stop, or when the device is lost: the servo stays where it had come to.
  [[nodiscard]] bool go(std::size_t servo, double pulse_us);

  /// What the device has to say, a line each; also why it is lost.
  [[nodiscard]] std::string news();
  [[nodiscard]] bool is_lost() const;
  /// An emergency stop was seen since the servos were switched on.
  [[nodiscard]] bool is_stopped() const noexcept { return stop_.presses() != presses_seen_; }

 private:
  void send();

  const Profile& profile_;
  const std::atomic<bool>& end_;
  EmergencyStop stop_;
  std::unique_ptr<Backend> backend_;
  ServoFrame frame_{};
  std::string origin_;
  bool is_on_{false};
  std::atomic<std::uint32_t> presses_seen_{0};  ///< of which the operator has been told
  std::atomic<std::uint64_t> steps_{0};
  rt::SafetyLines safety_;
};

}  // namespace corbot::cli
