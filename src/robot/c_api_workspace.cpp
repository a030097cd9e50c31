// SPDX-License-Identifier: Apache-2.0
// Implements corbot_robot.h with Robot: the workspace. Converts units and exceptions. No exception leaves
// this file.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cstring>
#include <string>
#include <vector>

#include "corbot/arm/shape_numbers.h"
#include "robot/recorded_call.h"

namespace {
using namespace corbot;

static_assert(CORBOT_MAX_FURTHER_SHAPES == FurtherShapes::kMostShapes);
static_assert(CORBOT_MAX_SHAPES == WorkspaceLimits::kMostShapes);
static_assert(CORBOT_SHAPE_NAME > WorkspaceShape::kLongestName + 1);

constexpr std::array<const char*, 3> kKindNames{"plane", "in", "out"};

corbot_shape shown(const WorkspaceShape& shape) {
  const ShapeNumbers numbers = numbers_of(shape);
  corbot_shape out{};
  copy_text(shape.name.data(), out.name, sizeof(out.name));
  out.kind = static_cast<corbot_shape_kind>(shape.kind);
  out.parts = shape.parts;
  std::copy(numbers.normal.begin(), numbers.normal.end(), out.normal);
  out.offset_m = numbers.offset_m;
  std::copy(numbers.from_m.begin(), numbers.from_m.end(), out.from_m);
  std::copy(numbers.to_m.begin(), numbers.to_m.end(), out.to_m);
  return out;
}

WantedShape wanted_of(const corbot_shape& shape) {
  const auto kind = static_cast<int>(shape.kind);
  if (kind < CORBOT_SHAPE_PLANE || kind > CORBOT_SHAPE_OUTSIDE)
    throw bad_argument("workspace", kind, fmt::format("kind {}, allowed 0 to 2", kind));
  WantedShape wanted;
  wanted.name.assign(shape.name, ::strnlen(shape.name, sizeof(shape.name)));
  wanted.kind = static_cast<ShapeKind>(kind);
  wanted.parts = shape.parts;
  std::copy_n(shape.normal, 3, wanted.numbers.normal.begin());
  wanted.numbers.offset_m = shape.offset_m;
  std::copy_n(shape.from_m, 3, wanted.numbers.from_m.begin());
  std::copy_n(shape.to_m, 3, wanted.numbers.to_m.begin());
  return wanted;
}

/// Returns the arguments for the audit log.
std::string text_of(const corbot_shape& shape) {
  const std::string name(shape.name, ::strnlen(shape.name, sizeof(shape.name)));
  const auto kind = static_cast<std::size_t>(shape.kind);
  const double* n = shape.normal;
  const double *a = shape.from_m, *b = shape.to_m;
  std::string text =
      fmt::format("{} {} parts {}", name, kind < kKindNames.size() ? kKindNames[kind] : "?", shape.parts);
  if (shape.kind == CORBOT_SHAPE_PLANE)
    return text + fmt::format(" {} {} {} {}", n[0], n[1], n[2], shape.offset_m);
  return text + fmt::format(" {} {} {} to {} {} {}", a[0], a[1], a[2], b[0], b[1], b[2]);
}

}  // namespace

void corbot_robot_workspace(const corbot_robot* robot, corbot_workspace* out) {
  *out = corbot_workspace{};
  guarded(nullptr, [&] {
    const auto further = robot->robot.further_shapes();
    const WorkspaceLimits& own = robot->robot.profile().arm.workspace;
    for (std::size_t k = 0; k < own.count; ++k) out->shapes[k] = shown(own.shapes[k]);
    out->profile_count = own.count;
    out->known = further ? 1 : 0;
    if (!further) return;
    for (std::size_t k = 0; k < further->count; ++k) out->shapes[own.count + k] = shown(further->shapes[k]);
    out->further_count = static_cast<std::size_t>(further->count);
  });
}

corbot_status corbot_robot_set_workspace(corbot_robot* robot, const corbot_caller* caller,
                                         const corbot_shape* shapes, size_t count, corbot_error* error) {
  const std::size_t given = std::min<std::size_t>(count, CORBOT_MAX_FURTHER_SHAPES);
  std::string text;
  guarded(nullptr, [&] {
    for (std::size_t k = 0; k < given; ++k) text += (k > 0 ? ", " : "") + text_of(shapes[k]);
  });
  return change(
      robot, caller, error,
      [&](Robot& of, const Wanted&) {
        std::vector<WantedShape> wanted;
        for (std::size_t k = 0; k < given; ++k) wanted.push_back(wanted_of(shapes[k]));
        wanted.resize(count);  // more than are read are refused by their number
        of.set_workspace(wanted);
      },
      "SetWorkspace([{}])", text);
}

corbot_status corbot_robot_reset_workspace(corbot_robot* robot, const corbot_caller* caller,
                                           corbot_error* error) {
  return change(
      robot, caller, error, [](Robot& of, const Wanted&) { of.reset_workspace(); }, "ResetWorkspace()");
}
