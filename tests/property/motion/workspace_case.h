// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <random>

#include "corbot/arm/arm_model.h"
#include "corbot/arm/workspace_limits.h"
#include "planner/planner.h"
#include "support/test_arms.h"

namespace corbot::test {

/// Draws random shapes and motions of an arm.
struct WorkspaceCase {
  const ArmModel& arm;
  std::mt19937_64& random;
  double in(double low, double high) const {
    return std::uniform_real_distribution<double>(low, high)(random);
  }
  Joints joints() const {
    Joints q{};
    for (std::size_t i = 0; i < arm.dof; ++i) q[i] = in(arm.joints[i].lower_q, arm.joints[i].upper_q);
    return q;
  }
  Vector3 unit() const {
    const Vector3 v{in(-1, 1), in(-1, 1), in(-1, 1)};
    return (1.0 / (norm(v) + 1e-9)) * v;
  }
  /// Gives the links random radii, and returns the last part that the arm has.
  std::size_t radii(ArmModel& of) const {
    for (double& radius_m : of.workspace.link_radius_m) radius_m = in(0.005, 0.08);
    const ArmParts parts = parts_of(points_of(of.kinematics.chain()));
    std::size_t last = 0;
    for (std::size_t part = 0; part < kArmParts; ++part)
      if (parts[part].exists) last = part;
    return last;
  }
  /// Places the shape near the tool at some joints, where it matters.
  WorkspaceShape shape() const {
    const Vector3 near_m = arm.kinematics.forward(joints()).position_m;
    const auto parts = std::uniform_int_distribution<std::uint32_t>(1, 63)(random);
    const int kind = std::uniform_int_distribution<int>(0, 3)(random);
    if (kind == 0) return plane_shape({{0, 0, 1}, near_m[2] - in(0.0, 0.3)}, parts);
    if (kind == 1) {
      const Vector3 normal = unit();
      return plane_shape({normal, dot(normal, near_m) - in(0.0, 0.3)}, parts);
    }
    const double half_m = kind == 2 ? in(0.01, 0.2) : in(0.3, 2.0);
    const Vector3 half{half_m, half_m * in(0.3, 1.0), half_m};
    return box_shape(kind == 2 ? ShapeKind::kOutside : ShapeKind::kInside, near_m - half, near_m + half,
                     parts);
  }
  MotionRequest request(int kind, const PlanStart& start) const {
    const Vector3 here = arm.kinematics.forward(start.position_q).position_m;
    const Vector3 there = arm.kinematics.forward(joints()).position_m;
    if (kind == 0 || (!has_paths(arm) && kind != 2)) return MoveJointsRequest{joints(), 0.0};
    if (kind == 1) return MoveRequest{there, 0.0};
    if (kind == 2) return DriveRequest{0, in(-1, 1), 0.1};
    if (kind == 3) return MoveSRequest{here + in(0.02, 0.3) * unit(), 0.0};
    return MoveCRequest{here, here + 0.05 * unit(), here + 0.08 * unit()};
  }
};

}  // namespace corbot::test
