// SPDX-License-Identifier: Apache-2.0
#include "cli/arm/kinematics.h"

#include <fmt/format.h>

#include <cstdio>
#include <optional>
#include <string_view>
#include <vector>

#include "cli/arm/arm_picture.h"
#include "cli/arm/arm_report.h"
#include "cli/arm/doubts.h"
#include "cli/arm/dry_run.h"
#include "client/failure.h"
#include "client/number.h"
#include "client/write_file.h"
#include "config/arms/write_urdf.h"
#include "corbot/units.h"

namespace corbot::cli {

using client::ExitCode;
using client::Failure;

namespace {

std::vector<double> numbers_of(std::string_view option, std::string_view text) {
  std::vector<double> numbers;
  for (bool more = true; more;) {
    const std::size_t comma = text.find(',');
    const std::string_view word = text.substr(0, comma);
    const auto number = client::parse_number(word);
    if (!number) throw Failure(ExitCode::kUsage, fmt::format("{}: {}", option, client::number_fault(word)));
    numbers.push_back(*number);
    more = comma != std::string_view::npos;
    if (more) text.remove_prefix(comma + 1);
  }
  return numbers;
}

Joints joints_of(const ArmModel& arm, const std::string& text) {
  Joints q{};
  if (text.empty()) return q;
  const std::vector<double> numbers = numbers_of("--joints", text);
  if (numbers.size() != arm.dof)
    throw Failure(ExitCode::kUsage,
                  fmt::format("--joints: {} numbers, but the arm has {} joints: give one number for each",
                              numbers.size(), arm.dof));
  for (std::size_t i = 0; i < arm.dof; ++i)
    q[i] = arm.kinematics.joint_kind(i) == JointKind::kRotary ? to_radians(numbers[i]) : numbers[i];
  return q;
}

/// Returns the solutions at the requested pose. A pose without a quaternion has the orientation at the joints
/// `at`. An arm with a tool pitch takes pitch 0, as `move` does.
PoseSolutions solutions_of(const ArmModel& arm, const std::string& text, const Joints& at) {
  Pose pose = arm.kinematics.forward(at);
  if (text.empty()) return solutions_at(arm, pose, true, at);
  const std::vector<double> n = numbers_of("--pose", text);
  if (n.size() != 3 && n.size() != 7)
    throw Failure(ExitCode::kUsage, "--pose: write X,Y,Z in metres, or X,Y,Z,QW,QX,QY,QZ");
  pose.position_m = {n[0], n[1], n[2]};
  if (n.size() == 3 && arm.kinematics.follows() == Follows::kPitch) pose.orientation = {};
  if (n.size() == 3) return solutions_at(arm, pose, false, at);
  const Quaternion q{n[3], n[4], n[5], n[6]};
  if (!(squared_norm(q) > 0.98) || !(squared_norm(q) < 1.02))
    throw Failure(ExitCode::kUsage, "--pose: the quaternion QW,QX,QY,QZ must have length 1");
  pose.orientation = normalised(q);
  return solutions_at(arm, pose, true, at);
}

}  // namespace

void kinematics(const KinematicsOptions& options) {
  const Profile profile = profile_of(options.profile);
  const Joints at = joints_of(profile.arm, options.joints);
  const Workspace workspace = workspace_of(profile.arm);
  const ArmReport report{profile, workspace, solutions_of(profile.arm, options.pose, at),
                         doubts_of(profile, workspace)};
  if (!options.svg.empty()) {
    const bool is_asked = !options.pose.empty() && !report.at.solutions.empty();
    client::write_file(options.svg,
                       arm_picture(profile, is_asked ? report.at.solutions.front().joints_q : at,
                                   options.thumbnail ? PictureSize::kThumbnail : PictureSize::kFull));
  }
  fmt::print("{}", options.json ? arm_json(report) : arm_text(report));
}

void export_urdf(const ExportOptions& options) {
  const Profile profile = profile_of(options.profile);
  const std::string xml = config::write_urdf(profile.arm, profile.name, profile.joint_names);
  if (options.output.empty()) {
    fmt::print("{}", xml);
  } else {
    client::write_file(options.output, xml);
  }
}

}  // namespace corbot::cli
