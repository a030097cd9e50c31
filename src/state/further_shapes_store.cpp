// SPDX-License-Identifier: Apache-2.0
#include "state/further_shapes_store.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "corbot/arm/shape_numbers.h"
#include "corbot/arm/shape_parts.h"
#include "corbot/kinematics/arm_parts.h"
#include "corbot/motion/frames.h"
#include "state/setting_text.h"

namespace corbot {
namespace {

constexpr std::int64_t kShapesFormat = 2;
constexpr std::array<std::string_view, 3> kKinds{"plane", "in", "out"};  // by ShapeKind

std::string line_of(const WorkspaceShape& shape) {
  const ShapeNumbers n = numbers_of(shape);
  std::vector<double> numbers(n.normal.begin(), n.normal.end());
  numbers.push_back(n.offset_m);
  if (shape.kind != ShapeKind::kPlane) {
    numbers.assign(n.from_m.begin(), n.from_m.end());
    numbers.insert(numbers.end(), n.to_m.begin(), n.to_m.end());
  }
  return fmt::format("  {{ name = \"{}\", kind = \"{}\", parts = {}, numbers = [{}] }},\n", shape.name.data(),
                     kKinds[static_cast<std::size_t>(shape.kind)], shape.parts, fmt::join(numbers, ", "));
}

std::vector<double> read_numbers(const toml::table& table, std::size_t count, const char* key = "numbers") {
  const toml::array* array = table[key].as_array();
  if (array == nullptr || array->size() != count)
    throw SettingError(fmt::format("{}: must be {} numbers", key, count));
  std::vector<double> numbers;
  for (const toml::node& node : *array) {
    const auto value = node.value<double>();
    if (!node.is_number() || !value || !(std::abs(*value) <= kFarthestShape_m))
      throw SettingError(fmt::format("{}: not a number of at most {}", key, kFarthestShape_m));
    numbers.push_back(*value);
  }
  return numbers;
}

template <class Shapes>
bool has_name(const Shapes& of, const WorkspaceShape& shape) {
  const auto end = of.shapes.begin() + static_cast<std::ptrdiff_t>(of.count);
  return std::any_of(of.shapes.begin(), end,
                     [&shape](const WorkspaceShape& other) { return other.name == shape.name; });
}

std::string line_of(const Pose& base) {
  const auto& [p, q] = base;
  return fmt::format("base = [{}]  # position in m, and orientation w, x, y, z\n",
                     fmt::join({p[0], p[1], p[2], q.w, q.x, q.y, q.z}, ", "));
}

Pose read_base(const toml::table& table) {
  const std::vector<double> n = read_numbers(table, 7, "base");
  const Pose base{{n[0], n[1], n[2]}, {n[3], n[4], n[5], n[6]}};
  if (!is_frame(base, kFarthestBase_m)) throw SettingError("base: not a frame");
  return base;
}

WorkspaceShape read_shape(const toml::table& table, const ArmModel& arm) {
  const auto name = required_value<std::string>(table, "name");
  if (!is_file_name(name) || name.size() > WorkspaceShape::kLongestName)
    throw SettingError("name: not the name of a plane or box");
  const auto kind_name = required_value<std::string>(table, "kind");
  const auto found = std::find(kKinds.begin(), kKinds.end(), kind_name);
  if (found == kKinds.end()) throw SettingError("kind: unknown");
  const auto parts = required_value<std::int64_t>(table, "parts");
  if (parts < 1 || parts > static_cast<std::int64_t>(kAllParts))
    throw SettingError(fmt::format("parts: {}, allowed 1 to {}", parts, kAllParts));
  const auto bits = static_cast<std::uint32_t>(parts);
  if (!can_hold_for(arm.workspace, parts_of(points_of(arm.kinematics.chain())), bits))
    throw SettingError(
        fmt::format("parts {}: none of this arm, or a link without link_radius_m", part_names(bits)));
  const auto kind = static_cast<ShapeKind>(found - kKinds.begin());
  ShapeNumbers numbers;
  if (kind == ShapeKind::kPlane) {
    const std::vector<double> read = read_numbers(table, 4);
    std::copy_n(read.begin(), 3, numbers.normal.begin());
    numbers.offset_m = read[3];
  } else {
    const std::vector<double> read = read_numbers(table, 6);
    std::copy_n(read.begin(), 3, numbers.from_m.begin());
    std::copy_n(read.begin() + 3, 3, numbers.to_m.begin());
    for (std::size_t i = 0; i < 3; ++i)
      if (!(numbers.from_m[i] < numbers.to_m[i])) throw SettingError("numbers: not a box");
  }
  WorkspaceShape shape = shape_of(kind, bits, numbers);
  std::copy(name.begin(), name.end(), shape.name.begin());
  return shape;
}

}  // namespace

std::string FurtherShapesText::write(const PlacedShapes& placed, const SettingOwner& owner,
                                     const ArmModel& arm) {
  std::string text = setting_head("The planes and boxes that were set beside the profile's [workspace].",
                                  kShapesFormat, owner, arm);
  text += line_of(placed.world_T_base);
  text += "shapes = [  # of a plane: normal, offset in m; of a box: corners in m\n";
  const FurtherShapes& further = placed.further;
  for (std::size_t k = 0; k < further.count; ++k) text += line_of(further.shapes[k]);
  return text + "]\n" + kSettingEnd;
}

PlacedShapes FurtherShapesText::read(std::string_view text, const SettingOwner& owner, const ArmModel& arm) {
  const toml::table table = read_setting(text, kMostBytes, kShapesFormat, owner, arm);
  const toml::array* array = table["shapes"].as_array();
  if (array == nullptr || array->size() > FurtherShapes::kMostShapes)
    throw SettingError(fmt::format("shapes: must be at most {}", FurtherShapes::kMostShapes));
  FurtherShapes further;
  for (const toml::node& node : *array) {
    const toml::table* one = node.as_table();
    if (one == nullptr) throw SettingError("shapes: not a table");
    const WorkspaceShape shape = read_shape(*one, arm);
    if (has_name(further, shape))
      throw SettingError(fmt::format("name: '{}' is the name of another plane or box", shape.name.data()));
    // The profile may have got a shape of this name since.
    if (has_name(arm.workspace, shape))
      throw SettingError(fmt::format("'{}' is also the name of a plane or box of the profile's [workspace]",
                                     shape.name.data()));
    further.shapes[further.count++] = shape;
  }
  if (!are_sound(further)) throw SettingError("shapes: a normal is no unit vector");
  return {further, read_base(table)};
}

}  // namespace corbot
