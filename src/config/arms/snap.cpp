// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <optional>

#include "config/arms/recognise.h"
#include "corbot/kinematics/spherical_wrist.h"

namespace corbot::config {
namespace {

/// Moves everything from joint `first` on, within frame 0.
void move_from(JointChain& chain, std::size_t first, const Pose& motion) {
  for (std::size_t i = first; i < chain.count; ++i) {
    JointAxis& axis = chain.axes[i];
    axis.direction = rotate(motion.orientation, axis.direction);
    axis.direction = (1.0 / norm(axis.direction)) * axis.direction;
    axis.point_m = motion.position_m + rotate(motion.orientation, axis.point_m);
  }
  chain.zero_T_n = motion * chain.zero_T_n;
  chain.zero_T_n.orientation = normalised(chain.zero_T_n.orientation);
}

/// Returns the exact direction for a joint, relative to those of the previous joints.
Vector3 meant_direction(const JointChain& chain, std::size_t joint) {
  const Vector3& own = chain.axes[joint].direction;
  for (std::size_t i = joint; i-- > 0;) {
    const Vector3& other = chain.axes[i].direction;
    if (norm(cross(own, other)) < kSnapped) return dot(own, other) > 0.0 ? other : -1.0 * other;
  }
  std::optional<Vector3> first;
  for (std::size_t i = joint; i-- > 0;) {
    const Vector3& other = chain.axes[i].direction;
    if (std::abs(dot(own, other)) >= kSnapped) continue;
    if (!first) {
      first = other;
    } else if (norm(cross(*first, other)) > 0.1) {  // perpendicular to two: their common normal
      const Vector3 n = cross(*first, other);
      return (std::copysign(1.0, dot(n, own)) / norm(n)) * n;
    }
  }
  if (!first) return own;
  const Vector3 square = own - dot(own, *first) * *first;
  return (1.0 / norm(square)) * square;
}

void snap_direction(JointChain& chain, std::size_t joint) {
  const Vector3 from = chain.axes[joint].direction;
  const Vector3 to = meant_direction(chain, joint);
  const Vector3 n = cross(from, to);
  const double sine = norm(n);
  if (sine > 0.0) {
    const Quaternion turned = about((1.0 / sine) * n, std::atan2(sine, dot(from, to)));
    const Vector3& pivot = chain.axes[joint].point_m;
    move_from(chain, joint, {pivot - rotate(turned, pivot), turned});
  }
  chain.axes[joint].direction = to;
}

/// Returns the vector from a point to the nearest point of an axis.
Vector3 to_axis(const Vector3& point, const JointAxis& axis) {
  const Vector3 away = axis.point_m - point;
  return away - dot(away, axis.direction) * axis.direction;
}

void snap_point(JointChain& chain, std::size_t joint) {
  const auto turns = [&](std::size_t i) { return chain.axes[i].kind == JointKind::kRotary; };
  if (joint == 0 || !turns(joint) || !turns(joint - 1)) return;
  const JointAxis &own = chain.axes[joint], &before = chain.axes[joint - 1];
  if (joint > 1 && turns(joint - 2)) {  // all three through one point: a spherical wrist
    const auto centre = crossing(chain.axes[joint - 2], before);
    if (centre && norm(to_axis(*centre, own)) < kSnapped) {
      move_from(chain, joint, {-1.0 * to_axis(*centre, own), {}});
      return;
    }
  }
  Vector3 n = cross(before.direction, own.direction);
  const double sine = norm(n);
  if (sine < kSnapped) {
    const Vector3 apart = to_axis(before.point_m, own);
    if (norm(apart) < kSnapped) move_from(chain, joint, {-1.0 * apart, {}});
    return;
  }
  n = (1.0 / sine) * n;
  const double apart = dot(own.point_m - before.point_m, n);
  if (std::abs(apart) < kSnapped) move_from(chain, joint, {-apart * n, {}});
}

}  // namespace

JointChain snapped(const JointChain& chain) {
  JointChain result = chain;
  for (std::size_t i = 0; i < std::min<std::size_t>(chain.count, kMaxJoints); ++i) {
    snap_direction(result, i);
    snap_point(result, i);
  }
  return result;
}

}  // namespace corbot::config
