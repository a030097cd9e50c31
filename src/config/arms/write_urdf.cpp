// SPDX-License-Identifier: Apache-2.0
#include "config/arms/write_urdf.h"

#include <fmt/format.h>

#include "config/arms/roll_pitch_yaw.h"

namespace corbot::config {
namespace {

std::string numbers(const Vector3& v) { return fmt::format("{} {} {}", v[0] + 0.0, v[1] + 0.0, v[2] + 0.0); }

std::string origin(const Pose& pose) {
  const RollPitchYaw a = to_roll_pitch_yaw(pose.orientation);
  return fmt::format("<origin xyz=\"{}\" rpy=\"{}\"/>", numbers(pose.position_m),
                     numbers({a.roll_rad, a.pitch_rad, a.yaw_rad}));
}

std::string fixed(const std::string& name, const std::string& parent, const std::string& child,
                  const Pose& pose) {
  return fmt::format(
      "  <link name=\"{2}\"/>\n"
      "  <joint name=\"{0}\" type=\"fixed\">\n    <parent link=\"{1}\"/>\n    <child link=\"{2}\"/>\n    "
      "{3}\n  </joint>\n",
      name, parent, child, origin(pose));
}

std::string moving(const std::string& name, const std::string& parent, const std::string& child,
                   const JointAxis& axis, const Vector3& offset_m, const JointLimits& limits) {
  return fmt::format(
      "  <link name=\"{2}\"/>\n"
      "  <joint name=\"{0}\" type=\"{3}\">\n    <parent link=\"{1}\"/>\n    <child link=\"{2}\"/>\n"
      "    <origin xyz=\"{4}\" rpy=\"0 0 0\"/>\n    <axis xyz=\"{5}\"/>\n"
      "    <limit lower=\"{6}\" upper=\"{7}\" velocity=\"{8}\" effort=\"0\"/>\n  </joint>\n",
      name, parent, child, axis.kind == JointKind::kRotary ? "revolute" : "prismatic", numbers(offset_m),
      numbers(axis.direction), limits.lower_q, limits.upper_q, limits.speed_q_s);
}

}  // namespace

std::string write_urdf(const ArmModel& arm, const std::string& robot, std::span<const std::string> names) {
  const JointChain& chain = arm.kinematics.chain();
  std::string xml =
      fmt::format("<?xml version=\"1.0\"?>\n<robot name=\"{}\">\n  <link name=\"{}\"/>\n", robot, kUrdfBase);
  std::string parent = "link_0";
  xml += fixed("stand", kUrdfBase, parent, chain.base_T_0);
  Vector3 at_m{};  // of the parent link, whose frame is parallel to frame 0 with all joints at zero
  for (std::size_t i = 0; i < chain.count; ++i) {
    // The point of a sliding axis is arbitrary: its link begins at the previous one.
    const JointAxis& axis = chain.axes[i];
    const Vector3 point_m = axis.kind == JointKind::kRotary ? axis.point_m : at_m;
    const std::string child = fmt::format("link_{}", i + 1);
    xml += moving(names[i], parent, child, axis, point_m - at_m, arm.joints[i]);
    parent = child;
    at_m = point_m;
  }
  xml += fixed("mount", parent, "flange", Pose{-1.0 * at_m, {}} * chain.zero_T_n);
  xml += fixed("tool", "flange", kUrdfTip, chain.n_T_tool);
  return xml + "</robot>\n";
}

}  // namespace corbot::config
