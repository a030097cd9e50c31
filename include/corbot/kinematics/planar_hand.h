// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <numbers>
#include <optional>

#include "corbot/kinematics/closed_form.h"

// The part of an orientation that a hand in the arm's plane takes: planar_arm.h. Real-time safe.

namespace corbot {

/// A shorter direction, or a shorter component that counts, is no direction.
inline constexpr double kNoDirection = 1e-9;

struct PlanarHand {
  double pitch_rad{};  ///< C: inclination from x towards z
  double cosine{1.0}, sine{};
  double roll_rad{};
  double error_rad{};  ///< the part of the orientation that it cannot take
};

/// A roll axis square to the parallel ones, at zero, in the arm's own frame.
struct RollAxis {
  double pitch_rad{};  ///< its inclination
  double lateral_m{};  ///< from axis 1's plane
  double raise_m{};    ///< height above the wrist axis, square to both
  Pose frame{};        ///< x along it, origin at the wrist axis' foot

  [[nodiscard]] static std::optional<RollAxis> recognise(const JointAxis& axis, const Pose& zero_T_family,
                                                         const Vector3& wrist_m) noexcept {
    const Quaternion unturn = conjugate(zero_T_family.orientation);
    const Vector3 along = rotate(unturn, axis.direction);
    if (!square(along, {0.0, 1.0, 0.0})) return std::nullopt;
    const Vector3 point = rotate(unturn, axis.point_m - zero_T_family.position_m);
    RollAxis roll{std::atan2(along[2], along[0]), point[1]};
    roll.frame.orientation = about({0.0, -1.0, 0.0}, roll.pitch_rad);
    const Vector3 up = rotate(roll.frame.orientation, {0.0, 0.0, 1.0});
    roll.raise_m = dot(point - wrist_m, up);
    roll.frame.position_m = wrist_m + Vector3{0.0, roll.lateral_m, 0.0} + roll.raise_m * up;
    return roll;
  }
};

/// The solution of a pose for an arm with roll and its hand on one side of axis 1.
struct Facing {
  static constexpr double kNoPlane_rad = 10.0;  ///< an error that is no angle

  IkSolution solution{};
  double error_rad{};
  double ahead_m{};  ///< the tool's distance ahead

  [[nodiscard]] bool is_on_side(bool behind) const noexcept {
    return (behind ? ahead_m : -ahead_m) <= 2.0 * kBorder_m;
  }
};

/// Returns the solution whose tool is on this side. If both are, it returns the one with the nearer
/// orientation, `own` if they are equally near. If neither is, it refuses.
[[nodiscard]] inline IkSolution nearer(const Facing& own, const Facing& other, bool behind) noexcept {
  const bool fits = own.is_on_side(behind), other_fits = other.is_on_side(behind);
  if (!fits && !other_fits) return {IkStatus::kTooClose, {}, 0.0, std::abs(own.ahead_m)};
  return fits && (!other_fits || own.error_rad <= other.error_rad + kNoDirection) ? own.solution
                                                                                  : other.solution;
}

/// Sets the base's turn for a point next to axis 1, or at its border. It takes the heading (x, y) of the
/// orientation, if the point fits, either way round. On the axis itself it takes the hint's if the
/// orientation has no heading.
inline void turn_beside_axis(Turn& t, const Vector3& point, double b, double x, double y, bool behind,
                             double hint_rad) noexcept {
  const bool upright = root_sum(x, y) < kNoDirection;
  const double heading = upright ? hint_rad : std::atan2(y, x);
  if (t.free) {
    t.angle_rad = behind && !upright ? heading + std::numbers::pi : heading;
    t.cosine = std::cos(t.angle_rad);
    t.sine = std::sin(t.angle_rad);
  } else if (!upright && !take_heading(t, point[0], point[1], b, behind, heading)) {
    (void)take_heading(t, point[0], point[1], b, behind, heading + std::numbers::pi);
  }
}

/// Returns `g` in the frame of the plane: Rz(−θ)·g.
[[nodiscard]] inline Quaternion in_plane_of(const Turn& t, const Quaternion& g) noexcept {
  const auto [c, s] = half_angle(t.cosine, t.sine);
  return {c * g.w + s * g.z, c * g.x + s * g.y, c * g.y - s * g.x, c * g.z - s * g.w};
}

/// Without roll: takes the nearest rotation about the plane's normal (twist) from Rz(−θ)·g; the rest (swing)
/// is the error. A tool upside down is 180 degrees off at every inclination. Then its x axis decides, and the
/// hint if the axis is across the plane.
[[nodiscard]] inline PlanarHand nearest_pitch(const Mounting& mount, const Turn& t, const Quaternion& g,
                                              const Quaternion& tool, double hint_rad) noexcept {
  const Quaternion rel = in_plane_of(t, g);
  const double along = rel.w * rel.w + rel.y * rel.y;
  PlanarHand hand;
  if (along > kNoDirection * kNoDirection) {
    hand.pitch_rad = -2.0 * std::atan2(rel.y, rel.w);
    hand.cosine = (rel.w - rel.y) * (rel.w + rel.y) / along;
    hand.sine = -2.0 * rel.w * rel.y / along;
    hand.error_rad = double_angle(root_sum(rel.x, rel.z), std::sqrt(along));
    return hand;
  }
  const Vector3 now = rotate(tool, {1.0, 0.0, 0.0});
  const Vector3 own = rotate(mount.hand.orientation, {1.0, 0.0, 0.0});
  const double ahead = now[0] * t.cosine + now[1] * t.sine;
  const bool across = root_sum(own[0], own[2]) < kNoDirection || root_sum(ahead, now[2]) < kNoDirection;
  hand.pitch_rad = across ? hint_rad : std::atan2(now[2], ahead) - std::atan2(own[2], own[0]);
  hand.cosine = std::cos(hand.pitch_rad);
  hand.sine = std::sin(hand.pitch_rad);
  const double same = std::cos(0.5 * hand.pitch_rad) * rel.w - std::sin(0.5 * hand.pitch_rad) * rel.y;
  hand.error_rad = 2.0 * std::atan2(1.0, std::abs(same));
  return hand;
}

/// With roll: the shortest rotation brings the hand's axis (x of g) into the plane; the roll is the
/// remainder. An axis square to the plane is a quarter off every direction. Then the hint's pitch counts.
[[nodiscard]] inline PlanarHand nearest_pitch_and_roll(const Turn& t, const Quaternion& g,
                                                       double hint_rad) noexcept {
  const Quaternion rel = in_plane_of(t, g);
  const double ax = 1.0 - 2.0 * (rel.y * rel.y + rel.z * rel.z);
  const double ay = 2.0 * (rel.x * rel.y + rel.w * rel.z);
  const double az = 2.0 * (rel.x * rel.z - rel.w * rel.y);
  const double length = root_sum(ax, az);
  const bool across = length < kNoDirection;
  PlanarHand hand;
  hand.pitch_rad = across ? hint_rad : std::atan2(az, ax);
  hand.cosine = across ? std::cos(hint_rad) : ax / length;
  hand.sine = across ? std::sin(hint_rad) : az / length;
  const auto [c, s] = half_angle(hand.cosine, hand.sine);
  hand.roll_rad = 2.0 * std::atan2(c * rel.x + s * rel.z, c * rel.w - s * rel.y);
  hand.error_rad = 0.5 * double_angle(std::abs(ay), length);
  return hand;
}

/// Returns the place of a tool in the hand, from its foot on the roll axis: ahead, across, above.
[[nodiscard]] inline Vector3 off_roll_axis(const Vector3& tool, const PlanarHand& hand) noexcept {
  const double c = std::cos(hand.roll_rad), s = std::sin(hand.roll_rad);
  const double up = tool[1] * s + tool[2] * c;
  return {-up * hand.sine, tool[1] * c - tool[2] * s, up * hand.cosine};
}

}  // namespace corbot
