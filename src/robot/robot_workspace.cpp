// SPDX-License-Identifier: Apache-2.0
// Sets planes and boxes beside the profile's [workspace], at run time.
#include <fmt/format.h>

#include <algorithm>

#include "planner/workspace_setting.h"
#include "robot/robot.h"

namespace corbot {
namespace {

bool has(const WorkspaceShape* shapes, std::size_t count, const std::string& name) {
  return std::any_of(shapes, shapes + count,
                     [&name](const WorkspaceShape& shape) { return name == shape.name.data(); });
}

}  // namespace

void Robot::set_workspace(const std::vector<WantedShape>& wanted) {
  const auto refuse = [](double value, const std::string& text) {
    throw bad_argument("workspace", value, text);
  };
  if (wanted.size() > FurtherShapes::kMostShapes) {
    refuse(static_cast<double>(wanted.size()),
           fmt::format("{} planes and boxes, allowed at most {}", wanted.size(), FurtherShapes::kMostShapes));
  }
  FurtherShapes further;
  const WorkspaceLimits& own = profile_.arm.workspace;
  for (const WantedShape& one : wanted) {
    const auto number = static_cast<double>(further.count);
    if (!is_name(one.name))
      refuse(number, fmt::format("the name of plane or box {} must be {}", number, name_rule()));
    if (has(own.shapes.data(), own.count, one.name) || has(further.shapes.data(), further.count, one.name))
      refuse(number, fmt::format("'{}' is the name of another plane or box", one.name));
    auto shape = checked_shape(profile_.arm, one.kind, one.parts, one.numbers);
    if (auto* refusal = std::get_if<PlanRefusal>(&shape)) {
      refusal->text = fmt::format("'{}': {}", one.name, refusal->text);
      check_setting(*refusal);
    }
    auto& taken = further.shapes[further.count++] = std::get<WorkspaceShape>(shape);
    std::copy(one.name.begin(), one.name.end(), taken.name.begin());
  }
  queue_.change_shapes(further, settings_.get());
}

void Robot::reset_workspace() { queue_.change_shapes(std::nullopt, settings_.get()); }

std::optional<FurtherShapes> Robot::further_shapes() const {
  if (!shapes_.is_known_at(frames().base_T_0)) return std::nullopt;
  return shapes_.shapes().value_or(FurtherShapes{});
}

PlanSettings Robot::settings_in_force() const {
  PlanSettings now = settings_.get();
  now.soft_limits = limits_.wanted();
  now.further_shapes = shapes_.shapes();
  return now;
}

}  // namespace corbot
