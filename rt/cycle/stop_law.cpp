// SPDX-License-Identifier: Apache-2.0
#include "rt/cycle/stop_law.h"

#include <algorithm>
#include <cmath>

namespace corbot::rt {
namespace {

/// The polynomial constant + linear k + square k².
struct Quadratic {
  double constant;
  double linear;
  double square;
};

/// Returns the sum over the whole numbers k with after < k <= last.
double sum(const Quadratic& of, double after, double last) noexcept {
  const auto linear = [](double n) { return n * (n + 1.0) / 2.0; };
  const auto square = [](double n) { return n * (n + 1.0) * (2.0 * n + 1.0) / 6.0; };
  return of.constant * (last - after) + of.linear * (linear(last) - linear(after)) +
         of.square * (square(last) - square(after));
}

}  // namespace

// For a velocity that must fall, a goes from a0 to -p at the jerk -j. It stays there, and goes to 0 at the
// jerk j. The two ramps take v0 + (a0² - p²)/2j and p²/2j; the rest of v0 is taken at -p.
StopLaw::StopLaw(double velocity, double acceleration, double acceleration_limit, double jerk_limit) noexcept
    : jerk_(jerk_limit) {
  sign_ = when_even(velocity, acceleration, jerk_limit) < 0.0 ? -1.0 : 1.0;
  velocity_ = sign_ * velocity;
  acceleration_ = sign_ * acceleration;
  const double to_take = velocity_ + acceleration_ * acceleration_ / (2.0 * jerk_);
  const double highest = std::sqrt(std::max(0.0, jerk_ * to_take));
  // A law that already brakes harder than allowed must not brake less at once.
  peak_ = std::max(std::min(highest, acceleration_limit), -acceleration_);
  falls_s_ = std::max(0.0, (acceleration_ + peak_) / jerk_);
  rises_s_ = peak_ / jerk_;
  if (peak_ > 0.0) holds_s_ = std::max(0.0, (to_take - peak_ * peak_ / jerk_) / peak_);
  const double falling = falls_s_ * (velocity_ + falls_s_ * (acceleration_ / 2.0 - falls_s_ * jerk_ / 6.0));
  const double holding = peak_ * holds_s_ * (rises_s_ + holds_s_) / 2.0;
  way_ = falling + holding + jerk_ * rises_s_ * rises_s_ * rises_s_ / 6.0;
}

double StopLaw::velocity(double time_s) const noexcept {
  const double rest_s = duration_s() - time_s;
  if (rest_s <= 0.0) return 0.0;
  if (rest_s <= rises_s_) return sign_ * jerk_ * rest_s * rest_s / 2.0;
  if (rest_s <= rises_s_ + holds_s_) return sign_ * peak_ * (rest_s - rises_s_ / 2.0);
  return sign_ * (velocity_ + time_s * (acceleration_ - jerk_ * time_s / 2.0));
}

double StopLaw::acceleration(double time_s) const noexcept {
  const double rest_s = duration_s() - time_s;
  if (rest_s <= 0.0) return 0.0;
  if (rest_s <= rises_s_) return -sign_ * jerk_ * rest_s;
  if (rest_s <= rises_s_ + holds_s_) return -sign_ * peak_;
  return sign_ * (acceleration_ - jerk_ * time_s);
}

double StopLaw::way(double time_s) const noexcept {
  const double rest_s = duration_s() - time_s;
  if (rest_s <= 0.0) return sign_ * way_;
  if (rest_s <= rises_s_) return sign_ * (way_ - jerk_ * rest_s * rest_s * rest_s / 6.0);
  if (rest_s <= rises_s_ + holds_s_) {
    const double held_s = rest_s - rises_s_;
    const double rising = jerk_ * rises_s_ * rises_s_ * rises_s_ / 6.0;
    return sign_ * (way_ - rising - peak_ * held_s * (rises_s_ + held_s) / 2.0);
  }
  return sign_ * time_s * (velocity_ + time_s * (acceleration_ / 2.0 - time_s * jerk_ / 6.0));
}

double StopLaw::distance(double period_s) const noexcept {
  // Counts the steps that end within each of the segments.
  const double first = std::floor(falls_s_ / period_s);
  const double second = std::floor((falls_s_ + holds_s_) / period_s);
  const double third = std::floor(duration_s() / period_s);
  const double falling =
      sum({velocity_, acceleration_ * period_s, -jerk_ * period_s * period_s / 2.0}, 0.0, first);
  const double held = duration_s() - rises_s_ / 2.0;
  const double holding = sum({peak_ * held, -peak_ * period_s, 0.0}, first, second);
  const double half_jerk = jerk_ / 2.0;
  const double rising = sum({half_jerk * duration_s() * duration_s(), -jerk_ * duration_s() * period_s,
                             half_jerk * period_s * period_s},
                            second, third);
  return sign_ * (falling + holding + rising) * period_s;
}

}  // namespace corbot::rt
