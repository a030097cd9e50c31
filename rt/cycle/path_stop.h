// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>

#include "rt/cycle/governed_motion.h"
#include "rt/cycle/stop_law.h"

namespace corbot::rt {

/// The way of a motion to rest on its path. One of its laws, the leading one, stops as fast as its own limits
/// allow, or a share of them. It is a StopLaw, exact and in closed form. The leading law's position gives
/// virtual time, and so the positions of the other laws, whose limits are checked in samples. One of them may
/// have no room for that jerk while the leading law still turns from its acceleration to braking. The leading
/// law then turns stepwise. Each step has the jerk that it has room for. Real-time safe, bounded.
class PathStop {
 public:
  enum class Turn { kAtOnce, kStepwise };
  struct Bounds {
    double duration_s;  ///< not to be reached
    double rate;        ///< not exceeded but by rounding, which grows in a motion's last milliseconds
  };

  PathStop() = default;
  PathStop(const GovernedMotion& motion, const RateState& from, std::size_t leader, double share) noexcept;

  /// Plans the stop. False if a law would exceed its limits, or if the leading law would come to its end
  /// first or turn round. Each sample is taken off `samples`; false also if none is left.
  [[nodiscard]] bool plan(const GovernedMotion& motion, Turn turn, const Bounds& bounds,
                          int* samples) noexcept;
  [[nodiscard]] double duration_s() const noexcept { return tail_begin_s_ + tail_.duration_s(); }
  /// Returns the state at a real time since its beginning.
  [[nodiscard]] RateState at(const GovernedMotion& motion, double elapsed_s) const noexcept;

 private:
  /// A step of constant jerk.
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
  /// Returns the leading law's state, by real time; its jerk is 0 here.
  [[nodiscard]] Step leading_at(double elapsed_s) const noexcept;

  std::size_t leader_{0};
  RateState from_;
  double acceleration_limit_{0.0};  ///< the share of the leading law's limit
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

/// Returns the least real time in which each of the laws could stop by itself: that of the slowest one.
[[nodiscard]] double shortest_stop_s(const GovernedMotion& motion, const RateState& from) noexcept;

}  // namespace corbot::rt
