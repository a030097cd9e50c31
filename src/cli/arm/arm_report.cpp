// SPDX-License-Identifier: Apache-2.0
#include "cli/arm/arm_report.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <cmath>
#include <vector>

#include "config/arms/arm_kind.h"
#include "config/arms/roll_pitch_yaw.h"
#include "corbot/arm/joint_units.h"

namespace corbot::cli {
namespace {

using config::ArmDescription;
using config::GeometryForm;

/// Limit (m, rad) below which a joint must move a thousand times as far as its tool.
constexpr double kNearSingular = 1e-3;
constexpr double kSingular = 1e-6;

std::string plain(double value) {
  const double tidy = std::round(value * 1e9) / 1e9;  // removes rounding errors such as 6e-17
  return fmt::format("{:.6g}", tidy + 0.0);
}

std::string count(std::size_t number, const char* what) {
  return fmt::format("{} {}{}", number, what, number == 1 ? "" : "s");
}

std::string tenthousandths(double value) {
  return fmt::format("{:.4f}", std::round(value * 1e4) / 1e4 + 0.0);
}

std::string list(const Vector3& v) {
  return fmt::format("{}, {}, {}", plain(v[0]), plain(v[1]), plain(v[2]));
}

/// Describes which part of an orientation the arm follows, and the handling of other orientations.
std::string describe(const ArmModel& model) {
  const double limit_rad = model.orientation_error_rad;
  const std::string others = limit_rad > 0.0
                                 ? fmt::format("others are taken as the nearest one, up to {} degrees off",
                                               plain(to_degrees(limit_rad)))
                                 : "other orientations are refused";
  switch (model.kinematics.follows()) {
    case Follows::kFull:
      return "every orientation";
    case Follows::kPitchAndRoll:
      return "pitch and roll of the tool in the arm's plane; " + others;
    case Follows::kPitch:
      return "the tool's pitch in the arm's plane; " + others;
    case Follows::kYaw:
      return "the tool's rotation about one axis; " + others;
    case Follows::kNone:
      break;
  }
  if (const std::uint32_t angles = model.kinematics.followed().count; angles > 0)
    return count(angles, "angle") + " of the tool, which lines and arcs keep; " + others;
  return "no orientation: it is an output of the position";
}

/// Describes the singular positions of arms of this family.
const char* singular_places(const Kinematics& arm) {
  return arm.visit([](const auto& form) { return std::remove_cvref_t<decltype(form)>::kSingularPlaces; });
}

std::string row_text(const DhRow& row, std::size_t index) {
  const bool turns = row.kind == JointKind::kRotary;
  const std::string theta = plain(to_degrees(row.theta_rad)) + (turns ? fmt::format(" + q{}", index) : "");
  const std::string d = plain(row.d_m) + (turns ? "" : fmt::format(" + q{}", index));
  return fmt::format("  {:<3} {:<18} {:<18} {:<10} {}\n", index, theta, d, plain(row.a_m),
                     plain(to_degrees(row.alpha_rad)));
}

std::string given_text(const ArmDescription& given) {
  if (given.form == GeometryForm::kUrdf)
    return fmt::format("geometry: a URDF ({}); frame 0 is its base link\n", given.urdf);
  const char* form = given.form == GeometryForm::kLengths ? "the paper's Table II, standard D-H"
                     : given.table.convention == DhConvention::kStandard ? "standard D-H"
                                                                         : "modified D-H";
  std::string text = fmt::format("geometry: {}, by table values\n  {:<3} {:<18} {:<18} {:<10} {}\n", form, "",
                                 "theta, degrees", "d, m", "a, m", "alpha, degrees");
  for (std::size_t i = 0; i < given.table.count; ++i) text += row_text(given.table.rows[i], i);
  return text;
}

std::string joints_text(const Profile& profile) {
  const Kinematics& arm = profile.arm.kinematics;
  std::string text = fmt::format(
      "joints, counted from 0 as in every command (axis 1 is that of joint 0); axes as verified where all "
      "are 0, frame 0\n  {:<3} {:<12} {:<26} {:<22} {:<16} {}\n",
      "", "name", "direction", "through, m", "home", "range");
  for (std::size_t i = 0; i < profile.arm.dof; ++i) {
    const JointAxis& axis = arm.chain().axes[i];
    const JointLimits& limits = profile.arm.joints[i];
    const JointKind kind = axis.kind;
    const bool turns = kind == JointKind::kRotary;
    text += fmt::format("  {:<3} {:<12} {:<26} {:<22} {:<16} {} to {} {}, {} a second\n", i,
                        profile.joint_names[i], (turns ? "about " : "along ") + list(axis.direction),
                        turns ? list(axis.point_m) : "", plain(to_shown(kind, profile.description.home_q[i])),
                        plain(to_shown(kind, limits.lower_q)), plain(to_shown(kind, limits.upper_q)),
                        unit_name(kind), plain(to_shown(kind, limits.speed_q_s)));
  }
  return text;
}

std::string workspace_text(const Workspace& space) {
  const auto span = [](const std::array<double, 2>& ends) {
    return fmt::format("{} to {}", tenthousandths(ends[0]), tenthousandths(ends[1]));
  };
  std::string text = fmt::format("workspace of the tool centre point, m: x {}, y {}, z {}\n",
                                 span(space.extent_m[0]), span(space.extent_m[1]), span(space.extent_m[2]));
  if (space.about_axis) text += fmt::format("  {} from axis 1, horizontally\n", span(space.radius_m));
  return text;
}

/// Returns the names of the joints that move while the tool does not.
std::string idle_text(const Profile& profile, const Regularity& regularity) {
  std::vector<std::string> names;
  for (std::size_t i = 0; i < profile.arm.dof; ++i) {
    if (std::abs(regularity.idle_q_s[i]) > 0.1) names.push_back(profile.joint_names[i]);
  }
  return fmt::format("{}", fmt::join(names, ", "));
}

std::string solution_text(const Profile& profile, const PoseSolution& solution) {
  std::string joints;
  for (std::size_t i = 0; i < profile.arm.dof; ++i)
    joints += fmt::format(
        "{:>10}", tenthousandths(to_shown(profile.arm.kinematics.joint_kind(i), solution.joints_q[i])));
  const std::string number = solution.number ? std::to_string(*solution.number) : "-";
  std::string text = fmt::format("  {:<3}{}", number, joints);
  if (!solution.beyond_range.empty()) {
    std::vector<std::string> names;
    for (const std::size_t joint : solution.beyond_range) names.push_back(profile.joint_names[joint]);
    text += fmt::format("  out of range: {}", fmt::join(names, ", "));
  }
  if (solution.orientation_error_rad > 1e-6)
    text += fmt::format("  orientation {:.4g} degrees off", to_degrees(solution.orientation_error_rad));
  if (solution.regularity.smallest < kNearSingular) {
    text += fmt::format("  {} (smallest singular value {:.1e}): {}",
                        solution.regularity.smallest < kSingular ? "SINGULAR" : "next to a singularity",
                        solution.regularity.smallest, idle_text(profile, solution.regularity));
  }
  return text + "\n";
}

std::string solutions_text(const Profile& profile, const PoseSolutions& at) {
  const Quaternion& given = at.pose.orientation;
  const Quaternion q = given.w < 0.0 ? Quaternion{-given.w, -given.x, -given.y, -given.z} : given;
  std::string text = fmt::format("solutions at {} m, quaternion (w, x, y, z) {}, {}, {}, {}\n",
                                 list(at.pose.position_m), plain(q.w), plain(q.x), plain(q.y), plain(q.z));
  if (at.solutions.empty()) {
    const bool says_so = at.refusal.starts_with("none");
    return text + (says_so ? "  " : "  none: ") + at.refusal + "\n";
  }
  text += "     ";
  for (std::size_t i = 0; i < profile.arm.dof; ++i)
    text += fmt::format("{:>10}", unit_name(profile.arm.kinematics.joint_kind(i)));
  text += '\n';
  for (const PoseSolution& solution : at.solutions) text += solution_text(profile, solution);
  return text;
}

}  // namespace

std::string arm_text(const ArmReport& report) {
  const Profile& profile = report.profile;
  const Kinematics& arm = profile.arm.kinematics;
  const ArmDescription& given = profile.description;
  std::string text = fmt::format("{}: family '{}', kind {}, {}\n", profile.name, arm.family(),
                                 config::name_of(profile.arm.kind), count(profile.arm.dof, "joint"));
  if (given.reason.empty()) {
    text += fmt::format("  at most {} a pose; verified against its axes at 1000 random joints\n",
                        count(arm.solution_count(), "solution"));
  } else {
    text += fmt::format("  no closed form, solved numerically: {}\n", given.reason);
  }
  for (const std::string& doubt : report.doubts) text += fmt::format("  warning: {}\n", doubt);
  text += fmt::format("  follows {}\n", describe(profile.arm));
  text += fmt::format("  largest difference from the geometry as given: {:.1e} m, {:.1e} rad\n",
                      given.difference_m, given.difference_rad);
  text += fmt::format("  singular places: {}\n", singular_places(arm));
  text += given_text(given) + joints_text(profile) + workspace_text(report.workspace);
  return text + solutions_text(profile, report.at);
}

}  // namespace corbot::cli
