// SPDX-License-Identifier: Apache-2.0
#include "planner/frame_settings.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "corbot/kinematics/tool_pose.h"
#include "planner/plan/refusal.h"

namespace corbot {
namespace {

constexpr double kUnitLength = 1e-6;    // users write six digits
constexpr double kLeastLever = 1e-9;    // about m³: a smaller determinant is rounding error
constexpr double kLeastInPlane = 1e-6;  // component of the tool's x axis, a unit vector

std::optional<PlanRefusal> check_frame(const Pose& frame, double farthest_m, const char* name) {
  for (const double x : frame.position_m) {
    if (std::abs(x) <= farthest_m) continue;
    return bad_parameter(
        name, Quantity::kLength, x, -farthest_m, farthest_m,
        fmt::format("coordinate {:.6g} m, allowed {:.6g} to {:.6g} m", x, -farthest_m, farthest_m));
  }
  const double length = std::sqrt(squared_norm(frame.orientation));
  if (std::abs(length - 1.0) <= kUnitLength) return std::nullopt;
  return bad_parameter(
      name, Quantity::kNumber, length, 1.0 - kUnitLength, 1.0 + kUnitLength,
      fmt::format("the quaternion has length {:.9g}, allowed 1 within {:.0e}", length, kUnitLength));
}

/// Returns the largest determinant of the tool centre point's velocities by the first three joints, over a
/// fixed set of joint values. It is 0 if these joints cannot move the point in all directions.
double best_lever(const Kinematics& arm) {
  double best = 0.0;
  for (int k = 1; k <= 16; ++k) {
    Joints q{};
    for (std::size_t i = 0; i < arm.joint_count(); ++i) {
      const double step = 0.61803398874989485 * static_cast<double>(k * static_cast<int>(i + 2));
      q[i] = step - std::nearbyint(step);
    }
    const Jacobian j = arm.jacobian(q);
    const Vector3 a{j[0][0], j[1][0], j[2][0]}, b{j[0][1], j[1][1], j[2][1]}, c{j[0][2], j[1][2], j[2][2]};
    best = std::max(best, std::abs(dot(a, cross(b, c))));
  }
  return best;
}

}  // namespace

Frames frames_in_force(const Kinematics& arm, const PlanSettings& settings) noexcept {
  const Frames own = frames_of(arm);
  return {settings.base_frame.value_or(own.base_T_0), settings.tool_frame.value_or(own.n_T_tool)};
}

Kinematics in_frames(const Kinematics& arm, const PlanSettings& settings) noexcept {
  Kinematics framed = arm;
  const Frames frames = frames_in_force(arm, settings);
  framed.set_frames(frames.base_T_0, frames.n_T_tool);
  return framed;
}

std::optional<PlanRefusal> check_base_frame(const Pose& world_T_base) {
  return check_frame(world_T_base, kFarthestBase_m, "world_T_base");
}

std::optional<PlanRefusal> check_tool_frame(const Kinematics& arm, const Pose& flange_T_tool) {
  static const char* const name = "flange_T_tool";
  if (auto refusal = check_frame(flange_T_tool, kFarthestTool_m, name)) return refusal;
  Kinematics framed = arm;
  framed.set_frames(arm.chain().base_T_0, flange_T_tool);
  if (framed.follows() == Follows::kNone && framed.joint_count() >= 3 && best_lever(framed) < kLeastLever) {
    const double off_m = norm(flange_T_tool.position_m);
    return bad_parameter(
        name, Quantity::kLength, off_m, 0.0, kFarthestTool_m,
        fmt::format("a tool centre point {:.6g} m from the flange that is on the axis of the last joint: "
                    "this arm could move it in two directions only",
                    off_m));
  }
  if (const auto* planar = std::get_if<PlanarArm>(&framed.form());
      planar != nullptr && framed.follows() == Follows::kPitch) {
    const Vector3 x = rotate(planar->mount.hand.orientation, {1.0, 0.0, 0.0});
    const double in_plane = root_sum(x[0], x[2]);
    if (in_plane < kLeastInPlane) {
      return bad_parameter(
          name, Quantity::kNumber, in_plane, kLeastInPlane, 1.0,
          fmt::format("a tool whose x axis is square to the plane in which this arm holds it has no "
                      "pitch: {:.3g} of it in the plane, at least {:.0e}",
                      in_plane, kLeastInPlane));
    }
  }
  return std::nullopt;
}

}  // namespace corbot
