// SPDX-License-Identifier: Apache-2.0
#include "cli/status_picture.h"

#include <fmt/format.h>

#include <algorithm>

#include "cli/arm/arm_picture.h"
#include "cli/arm/dry_run.h"
#include "client/local_robots.h"
#include "client/write_file.h"
#include "corbot/arm/joint_units.h"
#include "corbot/arm/shape_numbers.h"

namespace corbot::cli {
namespace {

Vector3 vector_of(const Corbot::Point& p) { return {p.x, p.y, p.z}; }

Pose pose_of(const Corbot::Pose& pose) {
  const auto& [p, q] = pose;
  return {vector_of(p), {q.w, q.x, q.y, q.z}};
}

WorkspaceShape shape_of(const Corbot::WorkspaceShape& given) {
  const ShapeKind kind = given.kind == Corbot::ShapePlane    ? ShapeKind::kPlane
                         : given.kind == Corbot::ShapeInside ? ShapeKind::kInside
                                                             : ShapeKind::kOutside;
  return corbot::shape_of(
      kind, given.parts,
      {vector_of(given.normal), given.offset, vector_of(given.least), vector_of(given.greatest)});
}

}  // namespace

void draw_status(client::Client& client, const std::string& robot, const StatusReport& now,
                 const std::string& file) {
  const auto state = client::read_state(robot);
  if (!state)
    throw client::Failure(client::ExitCode::kUnreachable, fmt::format("'{}' has just ended", robot));
  Profile profile = profile_of(state->profile_in_use);
  profile.name = robot;
  ArmModel& arm = profile.arm;
  Joints q{};
  for (std::size_t i = 0; i < arm.dof; ++i) {
    const JointKind kind = arm.kinematics.joint_kind(i);
    if (i < now.joints.size()) q[i] = from_shown(kind, now.joints[i]);
    if (i >= now.soft_limits.size()) continue;
    arm.joints[i].lower_q = from_shown(kind, now.soft_limits[i].lower);
    arm.joints[i].upper_q = from_shown(kind, now.soft_limits[i].upper);
  }
  if (now.frames) arm.kinematics.set_frames(pose_of(now.frames->base), pose_of(now.frames->tool));
  const Corbot::WorkspaceInfo_var shapes = client.call([](auto& one) { return one.Workspace(); });
  FurtherShapes further;
  for (CORBA::ULong k = 0; k < shapes->further.length() && further.count < further.shapes.size(); ++k)
    further.shapes[further.count++] = shape_of(shapes->further[k]);
  add_shapes(arm.workspace, further);
  client::write_file(file, arm_picture(profile, q));
}

}  // namespace corbot::cli
