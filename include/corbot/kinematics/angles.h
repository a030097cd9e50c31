// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <numbers>
#include <optional>

namespace corbot {

/// Returns the same angle in (−π, π]. Real-time safe.
[[nodiscard]] inline double wrap_angle(double angle_rad) noexcept {
  constexpr double kPi = std::numbers::pi;
  if (angle_rad > -kPi && angle_rad <= kPi) return angle_rad;
  const double wrapped = std::remainder(angle_rad, 2.0 * kPi);
  return wrapped <= -kPi ? kPi : wrapped;
}

/// Returns the same angle, by whole turns, nearest to `hint_rad`. An angle within half a turn of the hint
/// keeps every bit. Real-time safe.
[[nodiscard]] inline double nearest_turn(double angle_rad, double hint_rad) noexcept {
  constexpr double kTurn = 2.0 * std::numbers::pi;
  const double away = angle_rad - hint_rad;
  if (std::abs(away) < 3.0 * std::numbers::pi) {
    // By arithmetic: a branch among the three cases could not be predicted.
    return angle_rad -
           kTurn * (static_cast<int>(away > std::numbers::pi) - static_cast<int>(away < -std::numbers::pi));
  }
  return angle_rad - kTurn * std::nearbyint(away / kTurn);
}

/// Returns the same angle's turn within [lower, upper] that is nearest to the hint; nullopt if there is none.
/// Each bound may be missed by the tolerance. Real-time safe.
[[nodiscard]] inline std::optional<double> turn_within(double angle_rad, double lower_rad, double upper_rad,
                                                       double tolerance_rad, double hint_rad) noexcept {
  constexpr double kTurn = 2.0 * std::numbers::pi;
  const double least = std::ceil((lower_rad - tolerance_rad - angle_rad) / kTurn);
  const double most = std::floor((upper_rad + tolerance_rad - angle_rad) / kTurn);
  if (!(least <= most)) return std::nullopt;
  const double next = std::nearbyint((hint_rad - angle_rad) / kTurn);
  return angle_rad + kTurn * std::fmin(std::fmax(next, least), most);
}

}  // namespace corbot
