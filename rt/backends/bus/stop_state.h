// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstdint>
#include <optional>

#include "corbot/backend/backend.h"
#include "corbot/backend/emergency_stop.h"

namespace corbot::rt {

/// Whether a device's servos may be given energy and moved, and when the energy has to go off: by the cycle's word, and
/// without it once a press is so old as a ramp may take. After a press, or a loss, nothing is moved before the cycle has
/// answered it: by a frame that needs a Clear, or by so many frames that it must have seen it and has been cleared since.
/// Of the thread that serves the device; it is given the time.
class StopState {
 public:
  using Time = std::chrono::steady_clock::time_point;

  /// `stop` must outlive this. `ramp`: from a press to power off, at most.
  StopState(const EmergencyStop& stop, std::chrono::steady_clock::duration ramp) : stop_(stop), ramp_(ramp) {}

  /// What was pressed and released before is the first cycle's to latch.
  void begin() noexcept { presses_seen_ = stop_.presses(); }
  /// `newest`: loaded just before.
  void look(const ServoFrame& newest, Time now) noexcept;
  /// Has been published as lost: the cycle must answer that.
  void device_lost() noexcept { await_answer(); }
  [[nodiscard]] bool is_answered() const noexcept { return !is_awaiting_; }
  [[nodiscard]] bool is_stopped() const noexcept { return is_stopped_; }
  [[nodiscard]] bool is_power_off_due() const noexcept { return is_power_off_due_; }

 private:
  /// Frame 0 was the newest when this looked, after the event. The cycle reads presses before it writes a frame and the
  /// health after it: step 1 may have begun before the event, and its frame, though it needs a Clear, be of another
  /// Error; but step 1 reads the health after this look, so that frame 2 is written by a cycle that knows. If that needs
  /// no Clear, one has come meanwhile: a frame later it is known of a press, too.
  static constexpr std::uint64_t kAnswerFrames = 2;
  static constexpr std::uint64_t kClearedFrames = 3;

  void await_answer() noexcept {
    is_awaiting_ = is_stopped_ = true;
    asked_in_.reset();
  }

  const EmergencyStop& stop_;
  const std::chrono::steady_clock::duration ramp_;
  std::uint32_t presses_seen_{0};
  std::optional<Time> pressed_at_{};         ///< the first press that has not been cleared
  std::optional<std::uint64_t> asked_in_{};  ///< number of a frame that was newest after the event
  bool is_awaiting_{false};
  bool is_stopped_{false};
  bool is_power_off_due_{false};
};

}  // namespace corbot::rt
