// SPDX-License-Identifier: Apache-2.0
#include <nlohmann/json.hpp>

#include "cli/arm/arm_report.h"
#include "config/arms/arm_kind.h"
#include "corbot/arm/joint_units.h"

namespace corbot::cli {
namespace {

using nlohmann::json;

json pose_json(const Pose& pose) {
  const Quaternion& q = pose.orientation;
  return {{"position_m", pose.position_m}, {"quaternion_wxyz", {q.w, q.x, q.y, q.z}}};
}

json joint_json(const Profile& profile, std::size_t i) {
  const Kinematics& arm = profile.arm.kinematics;
  const JointAxis& axis = arm.chain().axes[i];
  const JointLimits& limits = profile.arm.joints[i];
  const bool turns = axis.kind == JointKind::kRotary;
  json joint{
      {"name", profile.joint_names[i]},
      {"kind", turns ? "turning" : "sliding"},
      {"unit", turns ? "degrees" : "m"},
      {"direction", axis.direction},
      {"home", to_shown(arm.joint_kind(i), profile.description.home_q[i])},
      {"range", {to_shown(arm.joint_kind(i), limits.lower_q), to_shown(arm.joint_kind(i), limits.upper_q)}},
      {"speed", to_shown(arm.joint_kind(i), limits.speed_q_s)}};
  if (turns) joint["point_m"] = axis.point_m;
  return joint;
}

json solution_json(const Profile& profile, const PoseSolution& solution) {
  json joints = json::array();
  for (std::size_t i = 0; i < profile.arm.dof; ++i)
    joints.push_back(to_shown(profile.arm.kinematics.joint_kind(i), solution.joints_q[i]));
  json beyond = json::array();
  for (const std::size_t joint : solution.beyond_range) beyond.push_back(profile.joint_names[joint]);
  return {{"number", solution.number ? json(*solution.number) : json(nullptr)},
          {"joints", joints},
          {"in_range", solution.beyond_range.empty()},
          {"beyond_range", beyond},
          {"orientation_error_deg", to_degrees(solution.orientation_error_rad)},
          {"smallest_singular_value", solution.regularity.smallest}};
}

}  // namespace

std::string arm_json(const ArmReport& report) {
  const Profile& profile = report.profile;
  const Kinematics& arm = profile.arm.kinematics;
  json joints = json::array(), solutions = json::array();
  for (std::size_t i = 0; i < profile.arm.dof; ++i) joints.push_back(joint_json(profile, i));
  for (const PoseSolution& solution : report.at.solutions)
    solutions.push_back(solution_json(profile, solution));
  json workspace{{"x_m", report.workspace.extent_m[0]},
                 {"y_m", report.workspace.extent_m[1]},
                 {"z_m", report.workspace.extent_m[2]}};
  if (report.workspace.about_axis) workspace["from_axis_1_m"] = report.workspace.radius_m;
  const json whole{{"name", profile.name},
                   {"family", arm.family()},
                   {"reason", profile.description.reason},
                   {"warnings", report.doubts},
                   {"kind", config::name_of(profile.arm.kind)},
                   {"most_solutions", arm.solution_count()},
                   {"difference_m", profile.description.difference_m},
                   {"difference_rad", profile.description.difference_rad},
                   {"joints", joints},
                   {"workspace", workspace},
                   {"pose", pose_json(report.at.pose)},
                   {"solutions", solutions},
                   {"refusal", report.at.refusal}};
  return whole.dump(2) + "\n";
}

}  // namespace corbot::cli
