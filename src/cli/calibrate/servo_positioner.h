// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "config/profile.h"
#include "corbot/backend/backend.h"
#include "corbot/backend/emergency_stop.h"
#include "rt/inputs/safety_lines.h"

namespace corbot::cli {

/// Positions single servos of a profile by their pulses, slowly, in place of corbot-rt. For `corbot
/// calibrate`. Not thread-safe, but for cancel(); has no thread before switch_on().
class ServoPositioner {
 public:
  static constexpr double kSpeed_us_per_s = 200.0;

  /// `end` is read between steps, and before anything gets energy.
  ServoPositioner(const Profile& profile, const std::atomic<bool>& end);
  ServoPositioner(const ServoPositioner&) = delete;
  ServoPositioner& operator=(const ServoPositioner&) = delete;
  ~ServoPositioner() { close(); }

  /// Opens the device; no servo gets a pulse yet. `kept_q`: the stored position, for a
  /// device that cannot report where its servos are. Throws std::runtime_error.
  void connect(const Joints* kept_q, double kept_opening);
  /// Where pulse_us() comes from after connect(), for a person.
  [[nodiscard]] const std::string& origin() const noexcept { return origin_; }
  /// They come from the stored position: the servos run there with their first pulses.
  [[nodiscard]] bool is_stored() const noexcept { return is_stored_; }
  /// Gives every servo the pulse at which it is assumed to be, and power where that is switched; again after
  /// an emergency stop. Throws std::runtime_error, also while that is pressed.
  void switch_on();
  /// Ends a switch_on() that is under way, also where servos wait for their turn: it throws. By any thread, after `end`.
  void cancel() noexcept { backend_->cancel(); }
  /// Holds or relaxes, as the profile has it.
  void close() noexcept;
  [[nodiscard]] bool is_on() const noexcept { return is_on_; }

  /// Index of the frame: the joints, then the gripper.
  [[nodiscard]] std::size_t servos() const noexcept { return frame_.servo_count; }
  [[nodiscard]] double pulse_us(std::size_t servo) const { return frame_.pulse_us[servo]; }
  [[nodiscard]] double lowest_us(std::size_t servo) const;
  [[nodiscard]] double highest_us(std::size_t servo) const;
  /// To a pulse within these bounds, at kSpeed_us_per_s; returns when it is there. False when the end was
  /// requested, at an emergency stop, or when the device is lost: the servo stays where it is then.
  [[nodiscard]] bool go(std::size_t servo, double pulse_us);

  /// The log of device and safety lines since the last call.
  [[nodiscard]] std::vector<LogLine> drain_log();
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
  bool is_stored_{false};
  bool is_on_{false};
  std::atomic<std::uint32_t> presses_seen_{0};  ///< that the operator has seen
  std::uint64_t looks_{0};                      ///< of the thread that watches the lines
  rt::SafetyLines safety_;
};

}  // namespace corbot::cli
