// SPDX-License-Identifier: Apache-2.0
#include "planner/workspace_setting.h"

#include <fmt/format.h>

#include <cmath>
#include <string>

#include "corbot/arm/shape_parts.h"
#include "corbot/interface_words.h"
#include "corbot/kinematics/arm_parts.h"
#include "planner/frame_settings.h"
#include "planner/plan/refusal.h"

namespace corbot {
namespace {

constexpr double kShortestNormal = 1e-6;
constexpr double kLongestNormal = 1e3;

PlanRefusal bad_shape(double value, double lower, double upper, const std::string& text) {
  return bad_parameter("workspace", Quantity::kNumber, value, lower, upper, text);
}

std::optional<PlanRefusal> check_place(double value_m, const char* what) {
  if (std::abs(value_m) <= kFarthestShape_m) return std::nullopt;
  return bad_shape(
      value_m, -kFarthestShape_m, kFarthestShape_m,
      fmt::format("{} {:.6g} m, allowed {:g} to {:g} m", what, value_m, -kFarthestShape_m, kFarthestShape_m));
}

std::optional<PlanRefusal> check_plane(const ShapeNumbers& numbers) {
  const double length = norm(numbers.normal);
  if (!(length >= kShortestNormal && length <= kLongestNormal)) {
    return bad_shape(length, kShortestNormal, kLongestNormal,
                     fmt::format("a normal of length {:.6g}, allowed {:g} to {:g}", length, kShortestNormal,
                                 kLongestNormal));
  }
  return check_place(numbers.offset_m, "the offset");
}

std::optional<PlanRefusal> check_box(const ShapeNumbers& numbers) {
  for (std::size_t i = 0; i < 3; ++i) {
    if (auto refusal = check_place(numbers.from_m[i], "a corner at")) return refusal;
    if (auto refusal = check_place(numbers.to_m[i], "a corner at")) return refusal;
    if (numbers.from_m[i] < numbers.to_m[i]) continue;
    return bad_shape(numbers.to_m[i], numbers.from_m[i], kFarthestShape_m,
                     fmt::format("a box from {:.6g} to {:.6g} m along {}: the second must be greater",
                                 numbers.from_m[i], numbers.to_m[i], "xyz"[i]));
  }
  return std::nullopt;
}

std::optional<PlanRefusal> check_parts(const ArmModel& arm, std::uint32_t parts) {
  const ArmParts known = parts_of(points_of(arm.kinematics.chain()));
  if (can_hold_for(arm.workspace, known, parts)) return std::nullopt;
  std::uint32_t allowed = 0, thin = 0;
  for (std::size_t part = 0; part < kArmParts; ++part) {
    if (!known[part].exists) continue;
    const bool is_guarded = part < kFirstLink || radius_m(arm.workspace, part) > 0.0;
    (is_guarded ? allowed : thin) |= bit_of(part);
  }
  if ((parts & thin) != 0) {
    return bad_shape(
        parts, 1, allowed,
        fmt::format("parts {}: the profile gives no link_radius_m for links, so the parts of this "
                    "arm are {}",
                    part_names(parts), part_names(allowed)));
  }
  if (parts != 0 && parts <= kAllParts) {
    return bad_shape(parts, 1, allowed,
                     fmt::format("parts {}: none is a part of this arm, which has {}", part_names(parts),
                                 part_names(allowed)));
  }
  return bad_shape(
      parts, 1, allowed,
      fmt::format("parts {}: a sum of {} that names a part of this arm, which has {}", parts,
                  "1 tool, 2 wrist, 4 elbow, 8 upper arm, 16 forearm and 32 hand", part_names(allowed)));
}

}  // namespace

std::variant<WorkspaceShape, PlanRefusal> checked_shape(const ArmModel& arm, ShapeKind kind,
                                                        std::uint32_t parts, const ShapeNumbers& numbers) {
  if (const auto refusal = check_parts(arm, parts)) return *refusal;
  const bool is_plane = kind == ShapeKind::kPlane;
  if (const auto refusal = is_plane ? check_plane(numbers) : check_box(numbers)) return *refusal;
  ShapeNumbers unit = numbers;
  if (is_plane) unit.normal = (1.0 / norm(numbers.normal)) * numbers.normal;
  return shape_of(kind, parts, unit);
}

std::optional<PlanRefusal> check_stands_within(const ArmModel& arm, const PlanSettings& settings,
                                               const FurtherShapes& further, const Joints& position_q) {
  const Kinematics framed = in_frames(arm.kinematics, settings);
  const ArmPoints points = points_of(framed.chain());
  const ArmParts parts = parts_of(points);
  const ArmStates states = part_states(framed.chain(), points, position_q);
  WorkspaceLimits limits = arm.workspace;
  add_shapes(limits, further);
  for (std::size_t k = arm.workspace.count; k < limits.count; ++k) {
    const WorkspaceShape& shape = limits.shapes[k];
    for (std::size_t part = 0; part < kArmParts; ++part) {
      if (!parts[part].exists || (shape.parts & bit_of(part)) == 0) continue;
      const double here_m = clearance_m(limits, k, part, parts[part], states);
      if (here_m >= -kWorkspaceTolerance_m) continue;
      const std::string text = fmt::format("the {} stands {:.3g} mm beyond the wanted '{}'", kPartNames[part],
                                           -1e3 * here_m, shape.name.data());
      PlanRefusal refusal(PlanRefusal::Kind::kLimitExceeded, kWorkspaceWord + text, Quantity::kLength);
      refusal.value = here_m;
      refusal.upper = kFarthestShape_m;
      refusal.text = text;
      return refusal;
    }
  }
  return std::nullopt;
}

}  // namespace corbot
