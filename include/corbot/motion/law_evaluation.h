// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>

#include "corbot/motion/time_law.h"

// A TimeLaw at an instant, in closed form. Real-time safe.

namespace corbot {

namespace detail {

/// The law with its duration and its distance scaled to 1. Then neither a distance of 1e-300 nor a duration
/// of 1e-100 s can overflow or vanish in the third power.
struct UnitLaw {
  double jerk_part, acc_part, ramp_part;  ///< t_jerk, t_acc and 2 t_jerk + t_acc, over the duration
  double jerk, velocity;                  ///< of the scaled law: peak values
  bool usable;
};

/// Below this the shape of a law counts as vanished: no jerk can be computed from it.
inline constexpr double kVanishedShape = 1e-200;

[[nodiscard]] inline UnitLaw unit_law(const TimeLaw& law) noexcept {
  const double inverse_s = 1.0 / law.duration_s();
  const double jerk_part = law.t_jerk_s * inverse_s;
  const double acc_part = law.t_acc_s * inverse_s;
  const double rise = jerk_part + acc_part;
  const double ramp = 2.0 * jerk_part + acc_part;
  const double shape = jerk_part * rise * (ramp + law.t_cruise_s * inverse_s);
  if (!(shape >= kVanishedShape) || !std::isfinite(shape)) return {0.0, 0.0, 0.0, 0.0, 1.0, false};
  const double jerk = 1.0 / shape;
  return {jerk_part, acc_part, ramp, jerk, jerk * jerk_part * rise, true};
}

/// First half of the scaled law, x in [0, 1/2].
[[nodiscard]] inline LawState first_half(const UnitLaw& unit, double x) noexcept {
  if (x <= unit.jerk_part) {
    const double jx = unit.jerk * x;
    return {jx * x * x / 6.0, jx * x / 2.0, jx, unit.jerk};
  }
  if (x <= unit.jerk_part + unit.acc_part) {
    const double y = x - unit.jerk_part;
    const double a = unit.jerk * unit.jerk_part;
    const double v = a * unit.jerk_part / 2.0;
    return {v * unit.jerk_part / 3.0 + v * y + a * y * y / 2.0, v + a * y, a, 0.0};
  }
  const double ramp_distance = unit.velocity * unit.ramp_part / 2.0;
  if (x < unit.ramp_part) {
    const double y = unit.ramp_part - x;  // until the cruise
    const double jy = unit.jerk * y;
    return {ramp_distance - unit.velocity * y + jy * y * y / 6.0, unit.velocity - jy * y / 2.0, jy,
            -unit.jerk};
  }
  return {ramp_distance + unit.velocity * (x - unit.ramp_part), unit.velocity, 0.0, 0.0};
}

}  // namespace detail

/// Returns position and derivatives at `t_s`, clamped into [0, T]. The second half mirrors the first from the
/// end, so the law is exact at both ends. At T the position is `distance`, bit for bit, and everything else
/// is 0. A zero distance stays 0. A law that is not well formed moves evenly rather than gives NaN; callers
/// refuse it before.
[[nodiscard]] inline LawState evaluate(const TimeLaw& law, double t_s) noexcept {
  const double duration_s = law.duration_s();
  if (t_s >= duration_s || !(duration_s > 0.0)) return {law.distance, 0.0, 0.0, 0.0};
  if (!(t_s > 0.0) || law.distance == 0.0) return {0.0, 0.0, 0.0, 0.0};
  const detail::UnitLaw unit = detail::unit_law(law);
  const double v_scale = law.distance / duration_s;
  const double a_scale = v_scale / duration_s;
  const double j_scale = a_scale / duration_s;
  if (!unit.usable || !std::isfinite(j_scale * unit.jerk))
    return {law.distance * (t_s / duration_s), 0.0, 0.0, 0.0};
  const double rest_s = duration_s - t_s;
  if (rest_s < t_s) {
    const LawState s = detail::first_half(unit, rest_s / duration_s);
    return {law.distance - law.distance * s.position, v_scale * s.velocity, -a_scale * s.acceleration,
            j_scale * s.jerk};
  }
  const LawState s = detail::first_half(unit, t_s / duration_s);
  return {law.distance * s.position, v_scale * s.velocity, a_scale * s.acceleration, j_scale * s.jerk};
}

/// Greatest magnitudes over the whole law.
struct LawPeaks {
  double velocity{};
  double acceleration{};
  double jerk{};
};

[[nodiscard]] inline LawPeaks peaks(const TimeLaw& law) noexcept {
  const double duration_s = law.duration_s();
  if (law.distance == 0.0 || !(duration_s > 0.0)) return {};
  const detail::UnitLaw unit = detail::unit_law(law);
  const double v_scale = std::abs(law.distance) / duration_s;
  const double a_scale = v_scale / duration_s;
  return {v_scale * unit.velocity, a_scale * unit.jerk * unit.jerk_part, a_scale / duration_s * unit.jerk};
}

/// Tells whether a law is finite, has no negative duration, and either nothing to travel or a shape to travel
/// it with. It does not check limits.
[[nodiscard]] inline bool is_well_formed(const TimeLaw& law) noexcept {
  const double duration_s = law.duration_s();
  if (!std::isfinite(law.distance) || !std::isfinite(duration_s)) return false;
  if (!(law.t_jerk_s >= 0.0 && law.t_acc_s >= 0.0 && law.t_cruise_s >= 0.0)) return false;
  if (law.distance == 0.0) return true;
  return duration_s > 0.0 && detail::unit_law(law).usable && std::isfinite(peaks(law).jerk);
}

}  // namespace corbot
