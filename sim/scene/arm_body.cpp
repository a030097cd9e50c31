// SPDX-License-Identifier: Apache-2.0
#include "sim/scene/arm_body.h"

#include <algorithm>
#include <array>
#include <cmath>

#include <Eigen/Geometry>

#include "corbot/kinematics/joint_chain.h"

namespace corbot::sim {
namespace {

using Eigen::Vector3d;

/// Base, upper arm, forearm and what follows; the last link is the hand.
constexpr std::array<double, 3> kRadii_m{0.035, 0.020, 0.018};
constexpr double kHandRadius_m = 0.022;
/// Axes that meet have no link between them.
constexpr double kShortestLink_m = 1e-6;

Vector3d vector_of(const Vector3& v) { return {v[0], v[1], v[2]}; }

/// The points at which the links meet, base frame, and the tool's pose.
std::vector<Vector3d> joints_of(const JointChain& chain, const Joints& q, Pose& tool) {
  std::vector<Vector3d> points{vector_of(chain.base_T_0.position_m)};
  const auto add = [&points](const Vector3d& point) {
    if ((point - points.back()).norm() > kShortestLink_m) points.push_back(point);
  };
  Pose pose = chain.base_T_0;
  for (std::size_t i = 0; i < chain.count; ++i) {
    const JointAxis& axis = chain.axes[i];
    if (axis.kind == JointKind::kRotary) {
      // An axis may name any of its points: the one next to the last point is meant.
      const Vector3d direction = vector_of(rotate(pose.orientation, axis.direction));
      const Vector3d point = vector_of(pose.position_m + rotate(pose.orientation, axis.point_m));
      add(point + direction.dot(points.back() - point) * direction);
    }
    pose = pose * displacement(axis, q[i]);
  }
  tool = pose * chain.zero_T_n * chain.n_T_tool;
  add(vector_of(tool.position_m));
  return points;
}

double radius_m(std::size_t link, std::size_t links) {
  return link + 1 == links ? kHandRadius_m : kRadii_m[std::min(link, kRadii_m.size() - 1)];
}

}  // namespace

ArmBody arm_body(const ArmModel& model, const ArmBase& base, double opening_m,
                 const std::function<double(std::size_t channel)>& shaft_us) {
  ArmBody arm;
  for (std::size_t i = 0; i < model.dof; ++i) {
    const ServoMap& servo = model.servos[i];
    arm.q[i] = (shaft_us(servo.channel) - servo.zero_us) / (servo.direction * servo.us_per_q);
  }
  Pose tool;
  const std::vector<Vector3d> points = joints_of(model.kinematics.chain(), arm.q, tool);
  const Eigen::AngleAxisd turn(base.yaw_rad, Vector3d::UnitZ());
  for (std::size_t i = 0; i + 1 < points.size(); ++i) {
    arm.links.push_back({base.position_m + turn * points[i], base.position_m + turn * points[i + 1],
                         radius_m(i, points.size() - 1)});
  }
  const auto axis = [&](const Vector3& unit) -> Vector3d {
    return turn * vector_of(rotate(tool.orientation, unit));
  };
  const Vector3d y = axis({0, 1, 0});
  const Vector3d z = axis({0, 0, 1});
  Vector3d across = std::abs(z.z()) <= std::abs(y.z()) ? z : y;
  across.z() = 0;
  const GripperModel& gripper = model.gripper;
  const double share =
      (shaft_us(gripper.channel) - gripper.closed_us) / (gripper.open_us - gripper.closed_us);
  arm.hand = {base.position_m + turn * vector_of(tool.position_m), axis({1, 0, 0}), across.normalized(),
              std::clamp(share, 0.0, 1.0) * opening_m};
  return arm;
}

void ArmClearance::check(std::span<const ArmBody> arms) {
  for (std::size_t a = 0; a < arms.size(); ++a) {
    for (std::size_t b = a + 1; b < arms.size(); ++b) {
      double nearest_m = std::numeric_limits<double>::infinity();
      for (const Capsule& one : arms[a].links) {
        for (const Capsule& other : arms[b].links) nearest_m = std::min(nearest_m, distance_m(one, other));
      }
      nearest_m_ = std::min(nearest_m_, nearest_m);
      if (nearest_m >= 0) {
        overlapping_.erase({a, b});
      } else if (overlapping_.insert({a, b}).second) {
        ++touches_;
      }
    }
  }
}

}  // namespace corbot::sim
