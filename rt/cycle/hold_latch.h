// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <cstdint>

#include "corbot/channel/control_flags.h"

namespace corbot::rt {

/// StopAndHold: the running motion is stopped on its path. From the request on nothing begins until a Clear
/// that leaves no cause of Error. Real-time safe.
///
/// Memory order. The servant raises hold_count and then counts a stop, with release. The cycle reads the
/// number of stops with acquire before it calls see(). So a command that was planned after that stop does not
/// begin before the request is seen. The load of hold_count is an acquire for processes that raise it alone.
class HoldLatch {
 public:
  /// `was_held`: the previous task was held, or was slowing down for a hold.
  void adopt(bool was_held) noexcept {
    if (was_held) state_ = State::kSlowingDown;
  }
  /// Switches to another servant: a request that is not cleared there counts, whichever task saw it.
  void follow(const ControlFlags& flags) noexcept {
    seen_ = flags.holds_cleared.load(std::memory_order_acquire);
    done_ = seen_;
  }
  /// Called once a step, after the number of stops was read and a Clear was carried out. If both come at once
  /// the request wins.
  void see(const ControlFlags& flags) noexcept {
    const std::uint64_t count = flags.hold_count.load(std::memory_order_acquire);
    if (count == seen_) return;
    seen_ = count;
    if (state_ == State::kFree) state_ = State::kSlowingDown;
    if (state_ == State::kHeld) done_ = seen_;
  }
  /// A hold was requested, and the arm is not at rest yet.
  [[nodiscard]] bool is_slowing_down() const noexcept { return state_ == State::kSlowingDown; }
  [[nodiscard]] bool is_active() const noexcept { return state_ != State::kFree; }
  /// Called at rest. True if a hold waited for rest: the robot goes into Error.
  [[nodiscard]] bool latch() noexcept {
    if (state_ != State::kSlowingDown) return false;
    state_ = State::kHeld;
    done_ = seen_;
    return true;
  }
  /// Ends the hold: the robot has left Error.
  void clear() noexcept {
    if (state_ == State::kHeld) state_ = State::kFree;
  }
  /// Returns the value of hold_count that has been carried out.
  [[nodiscard]] std::uint64_t done() const noexcept { return done_; }

 private:
  enum class State { kFree, kSlowingDown, kHeld };
  State state_{State::kFree};
  std::uint64_t seen_{0};
  std::uint64_t done_{0};
};

}  // namespace corbot::rt
