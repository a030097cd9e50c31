// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstdint>
#include <optional>

#include "corbot/backend/backend.h"
#include "corbot/backend/emergency_stop.h"

namespace corbot::rt {

/// Decides whether a device's servos may be energised and moved, and when they must be de-energised. The
/// cycle decides; without it the energy goes off when ramp_s has passed since a press. After a press, or a
/// loss, nothing moves before the cycle has answered it. An answer is a frame that needs a Clear, or so many
/// frames that the cycle must have seen the event and been cleared since. For the thread that serves the
/// device; it is given the time.
class StopState {
 public:
  using Time = std::chrono::steady_clock::time_point;

  /// `stop` must outlive this. `ramp`: longest time from a press to power off.
  StopState(const EmergencyStop& stop, std::chrono::steady_clock::duration ramp) : stop_(stop), ramp_(ramp) {}

  /// Starts; the first cycle latches presses that ended before.
  void begin() noexcept { presses_seen_ = stop_.presses(); }
  /// `newest`: loaded just before.
  void look(const ServoFrame& newest, Time now) noexcept;
  /// Reports that the device was published as lost: the cycle must answer that.
  void device_lost() noexcept { await_answer(); }
  [[nodiscard]] bool is_answered() const noexcept { return !is_awaiting_; }
  [[nodiscard]] bool is_stopped() const noexcept { return is_stopped_; }
  [[nodiscard]] bool is_power_off_due() const noexcept { return is_power_off_due_; }

 private:
  /// Frame 0 was the newest when this was called, after the event. The cycle reads presses before it writes a
  /// frame and the health after it. Step 1 may have begun before the event, and its frame, though it needs a
  /// Clear, may be of another Error. But step 1 reads the health after this call, so a cycle that knows the
  /// event writes frame 2. If frame 2 needs no Clear, a Clear has come meanwhile. One frame later the same
  /// holds for a press.
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
