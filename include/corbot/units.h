// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <numbers>

namespace corbot {

/// Profiles, files, messages and the CORBA interface have degrees; code has radians. `_q` in a name means rad
/// or m, as the joint turns or slides.
inline constexpr double kRadiansPerDegree = std::numbers::pi / 180.0;

[[nodiscard]] constexpr double to_radians(double angle_deg) noexcept { return angle_deg * kRadiansPerDegree; }
/// It multiplies by 180/π rather than divides by kRadiansPerDegree: the two differ in the last bit.
[[nodiscard]] constexpr double to_degrees(double angle_rad) noexcept {
  return angle_rad * (180.0 / std::numbers::pi);
}

}  // namespace corbot
