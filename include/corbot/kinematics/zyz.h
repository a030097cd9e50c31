// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <numbers>

#include "corbot/kinematics/arc_tangent.h"
#include "corbot/kinematics/pose.h"

// The third of the sub-problems (sub_problems.h): a wrist's three angles.

namespace corbot {

/// A wrist bent by no more (as sine of half the angle) has one axis twice: only the sum of its outer angles
/// counts.
inline constexpr double kOnAxis_rad = 1e-13;

/// A rotation as Rz(first)·Ry(middle)·Rz(last).
struct Zyz {
  bool free{};  ///< the outer axes coincide: first_rad is the hint
  double first_rad{}, middle_rad{}, last_rad{};
  double last_cosine{1.0}, last_sine{};  ///< of last_rad; not set if `free`
};

/// Returns the same rotation with the middle angle of the other sign; if the outer axes coincide, itself.
[[nodiscard]] inline Zyz flipped(Zyz t) noexcept {
  if (t.free) return t;
  t.middle_rad = -t.middle_rad;
  t.first_rad += std::numbers::pi;
  t.last_rad -= std::numbers::pi;
  t.last_cosine = -t.last_cosine;
  t.last_sine = -t.last_sine;
  return t;
}

/// Decomposes a unit quaternion: w, z = cos(β/2)·(cos, sin)((α+γ)/2) and y, −x = sin(β/2)·(cos,
/// sin)((α−γ)/2). Sum and difference of the outer angles come from different parts. Near sin β = 0 an
/// uncertainty of one is therefore compensated by the other, and the rotation keeps all its digits. `flip`
/// takes β ≤ 0. At sin β = 0 (kOnAxis_rad) α is the hint.
[[nodiscard]] inline Zyz zyz(const Quaternion& q, bool flip, double first_hint_rad) noexcept {
  Zyz t;
  const double upright = root_sum(q.w, q.z);
  const double tilted = root_sum(q.x, q.y);
  const double sum = 2.0 * arc_tangent(q.z, q.w);
  const double difference = 2.0 * arc_tangent(-q.x, q.y);
  t.middle_rad = 2.0 * arc_tangent(tilted, upright);
  if (tilted <= kOnAxis_rad || upright <= kOnAxis_rad) {
    t.free = true;
    t.first_rad = first_hint_rad;
    t.last_rad = tilted <= upright ? sum - first_hint_rad : first_hint_rad - difference;
    return t;
  }
  t.first_rad = 0.5 * (sum + difference);
  t.last_rad = 0.5 * (sum - difference);
  const double k = 1.0 / (upright * tilted);
  t.last_cosine = k * (q.w * q.y - q.z * q.x);
  t.last_sine = k * (q.z * q.y + q.w * q.x);
  return flip ? flipped(t) : t;
}

}  // namespace corbot
