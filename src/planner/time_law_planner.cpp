// SPDX-License-Identifier: Apache-2.0
#include "planner/time_law_planner.h"

#include <cmath>

namespace corbot {

// With d = |distance|, the two ramps to v cover v (2 t_jerk + t_acc) together. There are four cases: the
// velocity limit is reached or not, and with each the acceleration limit is reached or not. The formulas
// avoid cancellation, underflow and overflow from 1e-300 to 1e3.
TimeLaw plan_law(double distance, const LawLimits& limits) noexcept {
  const double d = std::abs(distance);
  if (!(d > 0.0)) return {};
  const double v = limits.velocity;
  const double a = limits.acceleration;
  const double j = limits.jerk;
  const double to_a_s = a / j;  // time to the acceleration limit

  TimeLaw law{distance, 0.0, 0.0, 0.0};
  if (v > a * to_a_s) {  // the acceleration limit is reached before the velocity limit
    const double ramps = v * (to_a_s + v / a);
    if (d >= ramps) {
      law.t_jerk_s = to_a_s;
      law.t_acc_s = v / a - to_a_s;
      law.t_cruise_s = (d - ramps) / v;
      return law;
    }
    const double spare = d / a - 2.0 * to_a_s * to_a_s;
    if (spare > 0.0) {  // positive root of t_acc² + 3 t_jerk t_acc − spare = 0
      law.t_jerk_s = to_a_s;
      law.t_acc_s = 2.0 * spare / (3.0 * to_a_s + std::sqrt(9.0 * to_a_s * to_a_s + 4.0 * spare));
      return law;
    }
  } else {
    const double to_v_s = std::sqrt(v / j);
    const double ramps = 2.0 * v * to_v_s;
    if (d >= ramps) {
      law.t_jerk_s = to_v_s;
      law.t_cruise_s = (d - ramps) / v;
      return law;
    }
  }
  law.t_jerk_s = std::cbrt(d) / std::cbrt(2.0 * j);
  return law;
}

TimeLaw stretch(const TimeLaw& law, double duration_s) noexcept {
  const double present_s = law.duration_s();
  if (law.distance == 0.0 || !(present_s > 0.0)) return {law.distance, 0.0, 0.0, duration_s};
  const double factor = duration_s / present_s;
  return {law.distance, law.t_jerk_s * factor, law.t_acc_s * factor, law.t_cruise_s * factor};
}

}  // namespace corbot
