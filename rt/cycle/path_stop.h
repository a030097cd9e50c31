// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>

#include "rt/cycle/governed_motion.h"
#include "rt/cycle/stop_law.h"

namespace corbot::rt {

/// The way of a motion to rest on its path. One of its laws, the leading one, stops as fast as its own limits allow, or a
/// share of them: a StopLaw, exact and in closed form. Where it is says where virtual time is, and so where the other
/// laws are: their limits are looked at in samples. Where one of them has no room for that jerk while the leading law
/// still turns from its acceleration to braking, it turns stepwise, at the jerk that each step has room for.
/// Real-time safe, bounded.
class PathStop {
 public:
  enum class Turn { kAtOnce, kStepwise };
  struct Bounds {
    double duration_s;  ///< not to be reached
    double rate;        ///< never exceeded
  };

  PathStop() = default;
  PathStop(const GovernedMotion& motion, const RateState& from, std::size_t leader, double share) noexcept;

  /// False where a law would exceed its limits, or the leading one would come to its end first or turn round. Each sample
  /// looked at is taken off `samples`; false also when none is left.
  [[nodiscard]] bool plan(const GovernedMotion& motion, Turn turn, const Bounds& bounds,
                          int* samples) noexcept;
  [[nodiscard]] double duration_s() const noexcept { return tail_begin_s_ + tail_.duration_s(); }
  /// At a real time since its beginning.
  [[nodiscard]] RateState at(const GovernedMotion& motion, double elapsed_s) const noexcept;

 private:
  /// Of constant jerk.
  struct Step {
    double begin_s;
    double way;
    double velocity;
    double acceleration;
    double jerk;
  };
  static constexpr std::size_t kMaxSteps = 16;
  class Walk;
  [[nodiscard]] bool turns_stepwise(Walk& walk, const Bounds& bounds) noexcept;
  [[nodiscard]] bool add_step(Walk& walk, double length_s) noexcept;
  [[nodiscard]] bool begin_tail(double begin_s, const Bounds& bounds) noexcept;
  /// Of the leading law, by real time; its jerk is 0 here.
  [[nodiscard]] Step leading_at(double elapsed_s) const noexcept;

  std::size_t leader_{0};
  RateState from_;
  double acceleration_limit_{0.0};  ///< the share of the leading law's
  double jerk_limit_{0.0};
  double begin_{0.0};     ///< the leading law's position
  double distance_{0.0};  ///< from there to its end
  std::array<Step, kMaxSteps> steps_{};
  std::size_t count_{0};
  Step start_{};
  StopLaw tail_;
  double tail_begin_s_{0.0};
  double tail_way_{0.0};
};

/// The least real time in which each of the laws could stop by itself: that of the one that needs longest.
[[nodiscard]] double shortest_stop_s(const GovernedMotion& motion, const RateState& from) noexcept;

}  // namespace corbot::rt
