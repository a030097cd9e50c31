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

/// Positions single servos of a profile slowly by their pulses, instead of corbot-rt. Used by `corbot
/// calibrate`. Not thread-safe except cancel(). Has no thread before switch_on().
class ServoPositioner {
 public:
  static constexpr double kSpeed_us_per_s = 200.0;

  /// `end` is read between steps, and before anything is energised.
  ServoPositioner(const Profile& profile, const std::atomic<bool>& end);
  ServoPositioner(const ServoPositioner&) = delete;
  ServoPositioner& operator=(const ServoPositioner&) = delete;
  ~ServoPositioner() { close(); }

  /// Opens the device; no servo gets a pulse yet. `kept_q` is the stored position, for a device that cannot
  /// report the positions of its servos. Throws std::runtime_error.
  void connect(const Joints* kept_q, double kept_opening);
  /// Describes, after connect(), the source of pulse_us() for a person.
  [[nodiscard]] const std::string& origin() const noexcept { return origin_; }
  /// Returns true if the pulses come from the stored position: the servos run there with their first pulses.
  [[nodiscard]] bool is_stored() const noexcept { return is_stored_; }
  /// Gives every servo the pulse of its assumed position, and switches on power if the profile has that. To
  /// be repeated after an emergency stop. Throws std::runtime_error, also while the stop is pressed.
  void switch_on();
  /// Ends a switch_on() in progress, which then throws, also while servos wait for their turn. Any thread may
  /// call it, after `end` is set.
  void cancel() noexcept { backend_->cancel(); }
  /// Holds or relaxes the servos, depending on the profile.
  void close() noexcept;
  [[nodiscard]] bool is_on() const noexcept { return is_on_; }

  /// Returns the number of servos in the frame: the joints, then the gripper.
  [[nodiscard]] std::size_t servos() const noexcept { return frame_.servo_count; }
  [[nodiscard]] double pulse_us(std::size_t servo) const { return frame_.pulse_us[servo]; }
  [[nodiscard]] double lowest_us(std::size_t servo) const;
  [[nodiscard]] double highest_us(std::size_t servo) const;
  /// Moves to a pulse within these bounds at kSpeed_us_per_s and returns on arrival. Returns false if the end
  /// was requested, at an emergency stop, or if the device is lost; the servo then stays in place.
  [[nodiscard]] bool go(std::size_t servo, double pulse_us);

  /// Returns the log of device and safety lines since the last call.
  [[nodiscard]] std::vector<LogLine> drain_log();
  [[nodiscard]] bool is_lost() const;
  /// Returns true if an emergency stop occurred since the servos were switched on.
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
  std::atomic<std::uint32_t> presses_seen_{0};  ///< number of presses that the operator knows of
  std::uint64_t looks_{0};                      ///< count of the thread that watches the lines
  rt::SafetyLines safety_;
};

}  // namespace corbot::cli
