// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cmath>
#include <type_traits>

// Poses and rotations: values, no allocation, nothing throws, every function real-time safe.

namespace corbot {

using Vector3 = std::array<double, 3>;

[[nodiscard]] constexpr Vector3 operator+(const Vector3& a, const Vector3& b) noexcept {
  return {a[0] + b[0], a[1] + b[1], a[2] + b[2]};
}
[[nodiscard]] constexpr Vector3 operator-(const Vector3& a, const Vector3& b) noexcept {
  return {a[0] - b[0], a[1] - b[1], a[2] - b[2]};
}
[[nodiscard]] constexpr Vector3 operator*(double k, const Vector3& a) noexcept {
  return {k * a[0], k * a[1], k * a[2]};
}
[[nodiscard]] constexpr double dot(const Vector3& a, const Vector3& b) noexcept {
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}
[[nodiscard]] constexpr Vector3 cross(const Vector3& a, const Vector3& b) noexcept {
  return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}
[[nodiscard]] inline double norm(const Vector3& a) noexcept { return std::sqrt(dot(a, a)); }

/// Returns √(a² + b²) for lengths and quaternion parts. It has no overflow guard, which makes std::hypot
/// slow.
[[nodiscard]] inline double root_sum(double a, double b) noexcept { return std::sqrt(a * a + b * b); }

/// A unit quaternion; q and −q are the same rotation.
struct Quaternion {
  double w{1.0}, x{}, y{}, z{};
};

/// Hamilton's product: `a * b` rotates by b first, then by a.
[[nodiscard]] constexpr Quaternion operator*(const Quaternion& a, const Quaternion& b) noexcept {
  return {a.w * b.w - a.x * b.x - a.y * b.y - a.z * b.z, a.w * b.x + a.x * b.w + a.y * b.z - a.z * b.y,
          a.w * b.y - a.x * b.z + a.y * b.w + a.z * b.x, a.w * b.z + a.x * b.y - a.y * b.x + a.z * b.w};
}
[[nodiscard]] constexpr Quaternion conjugate(const Quaternion& q) noexcept { return {q.w, -q.x, -q.y, -q.z}; }
[[nodiscard]] constexpr double squared_norm(const Quaternion& q) noexcept {
  return q.w * q.w + q.x * q.x + q.y * q.y + q.z * q.z;
}
/// Returns the quaternion of unit length; the argument must not be zero. A quaternion that is off by rounding
/// needs no root.
[[nodiscard]] inline Quaternion normalised(const Quaternion& q) noexcept {
  const double excess = squared_norm(q) - 1.0;
  const double k = std::abs(excess) < 1e-9 ? 1.0 - 0.5 * excess : 1.0 / std::sqrt(1.0 + excess);
  return {k * q.w, k * q.x, k * q.y, k * q.z};
}
[[nodiscard]] constexpr Vector3 rotate(const Quaternion& q, const Vector3& v) noexcept {
  const Vector3 u{q.x, q.y, q.z};
  const Vector3 t = 2.0 * cross(u, v);
  return v + q.w * t + cross(u, t);
}
/// Returns the rotation by `angle_rad` about a unit vector.
[[nodiscard]] inline Quaternion about(const Vector3& unit, double angle_rad) noexcept {
  const double s = std::sin(0.5 * angle_rad);
  return {std::cos(0.5 * angle_rad), s * unit[0], s * unit[1], s * unit[2]};
}

/// Returns 2·atan2(tilted, upright) for lengths: the angle of a rotation from the parts of its quaternion.
/// Mostly the angle is next to nothing, and then there is no function call.
[[nodiscard]] inline double double_angle(double tilted, double upright) noexcept {
  if (tilted < 1e-4 * upright) {
    const double ratio = tilted / upright;
    return 2.0 * (ratio - ratio * ratio * ratio / 3.0);
  }
  return 2.0 * std::atan2(tilted, upright);
}
/// Returns the angle in [0, π] of the rotation between two orientations. It uses atan2: exact to 1e-16 near
/// 0, where an arc cosine would lose half of the digits.
[[nodiscard]] inline double angle_between(const Quaternion& a, const Quaternion& b) noexcept {
  const Quaternion d = conjugate(a) * b;
  return double_angle(std::sqrt(d.x * d.x + d.y * d.y + d.z * d.z), std::abs(d.w));
}

/// A rotation matrix, row by row.
using Matrix3 = std::array<Vector3, 3>;

[[nodiscard]] constexpr Matrix3 to_matrix(const Quaternion& q) noexcept {
  const double xx = q.x * q.x, yy = q.y * q.y, zz = q.z * q.z;
  const double xy = q.x * q.y, xz = q.x * q.z, yz = q.y * q.z;
  const double wx = q.w * q.x, wy = q.w * q.y, wz = q.w * q.z;
  return {Vector3{1.0 - 2.0 * (yy + zz), 2.0 * (xy - wz), 2.0 * (xz + wy)},
          Vector3{2.0 * (xy + wz), 1.0 - 2.0 * (xx + zz), 2.0 * (yz - wx)},
          Vector3{2.0 * (xz - wy), 2.0 * (yz + wx), 1.0 - 2.0 * (xx + yy)}};
}

/// Returns the quaternion with w ≥ 0. It takes the greatest of the four parts from the diagonal, so that no
/// digits are lost (Shepperd 1978).
[[nodiscard]] inline Quaternion to_quaternion(const Matrix3& r) noexcept {
  const double trace = r[0][0] + r[1][1] + r[2][2];
  Quaternion q;
  if (trace >= r[0][0] && trace >= r[1][1] && trace >= r[2][2]) {
    q = {1.0 + trace, r[2][1] - r[1][2], r[0][2] - r[2][0], r[1][0] - r[0][1]};
  } else if (r[0][0] >= r[1][1] && r[0][0] >= r[2][2]) {
    q = {r[2][1] - r[1][2], 1.0 + r[0][0] - r[1][1] - r[2][2], r[0][1] + r[1][0], r[0][2] + r[2][0]};
  } else if (r[1][1] >= r[2][2]) {
    q = {r[0][2] - r[2][0], r[0][1] + r[1][0], 1.0 - r[0][0] + r[1][1] - r[2][2], r[1][2] + r[2][1]};
  } else {
    q = {r[1][0] - r[0][1], r[0][2] + r[2][0], r[1][2] + r[2][1], 1.0 - r[0][0] - r[1][1] + r[2][2]};
  }
  q = normalised(q);
  return q.w < 0.0 ? Quaternion{-q.w, -q.x, -q.y, -q.z} : q;
}
/// Returns the rotation whose matrix has these three orthonormal columns, right-handed.
[[nodiscard]] inline Quaternion from_columns(const Vector3& x, const Vector3& y, const Vector3& z) noexcept {
  return to_quaternion({Vector3{x[0], y[0], z[0]}, Vector3{x[1], y[1], z[1]}, Vector3{x[2], y[2], z[2]}});
}

/// Position and orientation of a frame, seen from another: `base_T_tool` is the tool frame in the base frame.
struct Pose {
  Vector3 position_m{};
  Quaternion orientation{};
};
static_assert(std::is_trivially_copyable_v<Pose>);

/// Chains poses: a_T_c = a_T_b * b_T_c.
[[nodiscard]] constexpr Pose operator*(const Pose& a, const Pose& b) noexcept {
  return {a.position_m + rotate(a.orientation, b.position_m), a.orientation * b.orientation};
}
[[nodiscard]] constexpr Pose inverse_of(const Pose& a) noexcept {
  const Quaternion q = conjugate(a.orientation);
  return {-1.0 * rotate(q, a.position_m), q};
}
[[nodiscard]] inline bool is_finite(const Pose& a) noexcept {
  // A sum of finite numbers may overflow; poses of an arm do not.
  const Quaternion& q = a.orientation;
  return std::isfinite(a.position_m[0] + a.position_m[1] + a.position_m[2] + q.w + q.x + q.y + q.z) &&
         squared_norm(q) > 0.0;
}

}  // namespace corbot
