// SPDX-License-Identifier: Apache-2.0
#include "sim/scene/arm_body.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include <Eigen/Geometry>

#include "corbot/kinematics/closed_form.h"
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

/// An arm's chain at some joints, base frame.
struct ChainShape {
  std::vector<Vector3d> points_m;  ///< at which the links meet; the last one is the tool centre point
  Pose tool;
  Vector3d hand;  ///< along the last link
};

ChainShape shape_of(const JointChain& chain, const Joints& q) {
  std::vector<Vector3d> points{vector_of(chain.base_T_0.position_m)};
  const auto add = [&points](const Vector3d& point) {
    if ((point - points.back()).norm() > kShortestLink_m) points.push_back(point);
  };
  Pose pose = chain.base_T_0;
  Vector3d direction = Vector3d::Zero();  // of the joint's axis
  bool has_turned = false;                // the joint before
  for (std::size_t i = 0; i < chain.count; ++i) {
    const JointAxis& axis = chain.axes[i];
    const bool turns = axis.kind == JointKind::kRotary;
    direction = vector_of(rotate(pose.orientation, axis.direction));
    const Vector3d point = vector_of(pose.position_m + rotate(pose.orientation, axis.point_m));
    const Vector3d along = direction.dot(points.back() - point) * direction;
    if (turns && has_turned && parallel(chain.axes[i - 1].direction, axis.direction)) {
      // Parallel axes have no nearest points. The link is where the profile has the later axis' point.
      add(points.back() - along);
      add(point);
    } else if (turns) {
      add(point + along);
    }
    pose = pose * displacement(axis, q[i]);
    has_turned = turns;
  }
  const Pose tool = pose * chain.zero_T_n * chain.n_T_tool;
  const Vector3d tool_m = vector_of(tool.position_m);
  // Their lengths may be 0 for a moment, while a slide is at 0: the number of links is the same.
  if (!has_turned) points.emplace_back(tool_m - direction.dot(tool_m - points.back()) * direction);
  const Vector3d hand = tool_m - points.back();
  points.push_back(tool_m);
  return {std::move(points), tool, hand.norm() > kShortestLink_m ? hand : direction};
}

/// The tool's axes, world.
using ToolAxes = std::array<Vector3d, 3>;

/// Sets the hand's direction to the axis that is nearest to the last link. The fingers close along the usual
/// one of the other two, unless the third one is clearly nearer to the horizontal. In a grasp from above both
/// are horizontal.
void set_directions(Hand& hand, const ToolAxes& axes, const Vector3d& last_link) {
  constexpr double kClearly = 0.1;  // of the sine of the inclination
  const auto along = [&](const Vector3d& axis) { return axis.dot(last_link); };
  const auto approach =
      static_cast<std::size_t>(std::max_element(axes.begin(), axes.end(),
                                                [&](const auto& a, const auto& b) {
                                                  return std::abs(along(a)) < std::abs(along(b));
                                                }) -
                               axes.begin());
  hand.direction = std::copysign(1.0, along(axes[approach])) * axes[approach];
  const std::size_t usual = approach == 2 ? 1 : 2;
  const Vector3d& other = axes[3 - approach - usual];
  hand.across = std::abs(other.z()) + kClearly < std::abs(axes[usual].z()) ? other : axes[usual];
  hand.across.z() = 0;
  hand.across.normalize();
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
  const ChainShape shape = shape_of(model.kinematics.chain(), arm.q);
  const std::vector<Vector3d>& points = shape.points_m;
  const Eigen::AngleAxisd turn(base.yaw_rad, Vector3d::UnitZ());
  for (std::size_t i = 0; i + 1 < points.size(); ++i) {
    arm.links.push_back({base.position_m + turn * points[i], base.position_m + turn * points[i + 1],
                         radius_m(i, points.size() - 1)});
  }
  const GripperModel& gripper = model.gripper;
  const double share =
      (shaft_us(gripper.channel) - gripper.closed_us) / (gripper.open_us - gripper.closed_us);
  arm.hand.tool_m = arm.links.back().to_m;
  arm.hand.opening_m = std::clamp(share, 0.0, 1.0) * opening_m;
  const auto axis = [&](const Vector3& unit) -> Vector3d {
    return turn * vector_of(rotate(shape.tool.orientation, unit));
  };
  set_directions(arm.hand, {axis({1, 0, 0}), axis({0, 1, 0}), axis({0, 0, 1})}, turn * shape.hand);
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
