// SPDX-License-Identifier: Apache-2.0
#include "cli/arm/arm_line.h"

namespace corbot::cli {

ArmLine arm_line(const Kinematics& arm, const Joints& q) {
  const JointChain& chain = arm.chain();
  Pose pose = chain.base_T_0;
  ArmLine line;
  std::vector<Vector3>& points = line.points_m;
  points.push_back(pose.position_m);
  for (std::size_t i = 0; i < chain.count; ++i) {
    const JointAxis& axis = chain.axes[i];
    const Vector3 direction = rotate(pose.orientation, axis.direction);
    if (axis.kind == JointKind::kRotary) {
      const Vector3 point = pose.position_m + rotate(pose.orientation, axis.point_m);
      const Vector3 on_axis = point + dot(points.back() - point, direction) * direction;
      // The point lies next to the previous one. A first axis through the base is an exception: its link goes
      // up to the axis's own point.
      points.push_back(norm(on_axis - points.back()) > 1e-9 ? on_axis : point);
      line.joints.push_back({axis.kind, points.back()});
    } else {
      line.joints.push_back({axis.kind, points.back()});
      if (q[i] != 0.0) points.push_back(points.back() + q[i] * direction);
    }
    pose = pose * displacement(axis, q[i]);
  }
  const Pose flange = pose * chain.zero_T_n;
  points.push_back(flange.position_m);
  points.push_back((flange * chain.n_T_tool).position_m);
  return line;
}

}  // namespace corbot::cli
