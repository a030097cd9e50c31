// SPDX-License-Identifier: Apache-2.0
#include "config/workspace_schema.h"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <string>

#include "corbot/kinematics/arm_parts.h"

namespace corbot {
namespace {

constexpr Bounds kPlace{-kFarthestShape_m, kFarthestShape_m, false, "m"};
constexpr const char* kFloorName = "floor";
constexpr Bounds kRadius{0.001, 10, false, "m"};
constexpr const char* kLinks = "links";
constexpr std::uint32_t kAllPoints = (1u << kFirstLink) - 1;

/// Returns the arm's links as a set of parts.
std::uint32_t links_of(const ArmModel& arm) {
  const ArmParts known = parts_of(points_of(arm.kinematics.chain()));
  std::uint32_t links = 0;
  for (std::size_t part = kFirstLink; part < kArmParts; ++part)
    if (known[part].exists) links |= bit_of(part);
  return links;
}

/// Reads a radius for each link that the arm has.
void read_radii(Section& section, ArmModel& arm) {
  constexpr const char* kKey = "link_radius_m";
  if (!section.has(kKey) || arm.kinematics.joint_count() == 0) return section.skip(kKey);
  const std::uint32_t links = links_of(arm);
  if (links == 0) {
    section.skip(kKey);
    return section.refuse(kKey, "must be left out: this arm has no links");
  }
  const auto radii_m = section.numbers(kKey, static_cast<std::size_t>(std::popcount(links)), kRadius);
  if (!radii_m) return;
  std::size_t next = 0;
  for (std::size_t k = 0; k < kArmLinks; ++k)
    if ((links & bit_of(kFirstLink + k)) != 0) arm.workspace.link_radius_m[k] = (*radii_m)[next++];
}

/// Returns the links for a shape. Without their radii it holds for none.
std::uint32_t read_links(Section& section, const ArmModel& arm) {
  const auto& radii_m = arm.workspace.link_radius_m;
  if (std::any_of(radii_m.begin(), radii_m.end(), [](double each_m) { return each_m > 0.0; }))
    return links_of(arm);
  if (arm.kinematics.joint_count() > 0)
    section.refuse("parts", "names the links, so link_radius_m must give a radius for each of them");
  return 0;
}

/// Reads `parts`; without it a shape holds for all points of the arm.
std::uint32_t read_parts(Section& section, const ArmModel& arm) {
  if (!section.has("parts")) {
    section.skip("parts");
    return kAllPoints;
  }
  const ArmPoints known = points_of(arm.kinematics.chain());
  std::uint32_t parts = 0;
  for (const std::string& name :
       section.texts("parts", kFirstLink + 1).value_or(std::vector<std::string>{})) {
    if (name == kLinks) {
      parts |= read_links(section, arm);
      continue;
    }
    const auto end = kPartNames.begin() + kFirstLink;
    const auto found = std::find(kPartNames.begin(), end, name);
    const auto part = static_cast<std::size_t>(found - kPartNames.begin());
    if (found == end)
      section.refuse("parts", "must be of \"tool\", \"wrist\", \"elbow\" and \"links\"");
    else if (!known[part].exists && arm.kinematics.joint_count() > 0)
      section.refuse("parts", fmt::format("names the {}, which this arm does not have: leave it out", name));
    else
      parts |= bit_of(part);
  }
  return parts;
}

std::optional<Vector3> read_vector(Section& section, std::string_view key, const Bounds& bounds) {
  const auto numbers = section.numbers(key, 3, bounds);
  if (!numbers) return std::nullopt;
  return Vector3{(*numbers)[0], (*numbers)[1], (*numbers)[2]};
}

/// Gives the shape its name and adds it.
void add_shape(Section& section, std::string_view key, const std::string& name, WorkspaceShape shape,
               WorkspaceLimits& limits) {
  const auto end = limits.shapes.begin() + limits.count;
  if (std::any_of(limits.shapes.begin(), end,
                  [&name](const WorkspaceShape& other) { return name == other.name.data(); }))
    return section.refuse(key, "is the name of another plane or box of this workspace");
  if (limits.count == WorkspaceLimits::kMostOfProfile)
    return section.refuse(key, fmt::format("is one plane or box too many: a workspace has at most {}",
                                           WorkspaceLimits::kMostOfProfile));
  std::copy(name.begin(), name.end(), shape.name.begin());
  limits.shapes[limits.count++] = shape;
}

/// Reads what planes and boxes have in common, and adds the shape if it is complete.
void finish_shape(Section& section, std::optional<WorkspaceShape> shape, ArmModel& arm) {
  const auto name = section.text("name");
  const bool is_named = name && is_name(*name);
  if (name && !is_named) section.refuse("name", "must be " + name_rule());
  const std::uint32_t parts = read_parts(section, arm);
  section.finish();
  if (!shape || !is_named) return;
  shape->parts = parts;
  add_shape(section, "name", *name, *shape, arm.workspace);
}

void read_plane(Section section, ArmModel& arm) {
  const auto normal = read_vector(section, "normal", {-1e3, 1e3});
  const auto offset_m = section.number("offset_m", kPlace);
  std::optional<WorkspaceShape> shape;
  if (normal && norm(*normal) < 1e-6)
    section.refuse("normal", "must be a vector longer than 0, into the side where the arm stays");
  else if (normal && offset_m)
    shape = plane_shape({(1.0 / norm(*normal)) * *normal, *offset_m}, 0);
  finish_shape(section, shape, arm);
}

void read_box(Section section, ArmModel& arm) {
  const auto from_m = read_vector(section, "from_m", kPlace);
  const auto to_m = read_vector(section, "to_m", kPlace);
  const std::string stay = section.text("stay").value_or("");
  if (section.has("stay") && stay != "out" && stay != "in")
    section.refuse("stay", "must be \"out\" or \"in\"");
  std::optional<WorkspaceShape> shape;
  if (from_m && to_m) {
    const bool is_box = (*from_m)[0] < (*to_m)[0] && (*from_m)[1] < (*to_m)[1] && (*from_m)[2] < (*to_m)[2];
    if (!is_box) section.refuse("to_m", "must be greater than from_m along x, y and z");
    shape = box_shape(stay == "in" ? ShapeKind::kInside : ShapeKind::kOutside, *from_m, *to_m, 0);
  }
  finish_shape(section, shape, arm);
}

}  // namespace

void read_workspace(Section section, ArmModel& arm) {
  constexpr std::uint32_t kHand = bit_of(0) | bit_of(1);  // tool and wrist
  read_radii(section, arm);
  if (section.has("floor_m")) {
    if (const auto height_m = section.number("floor_m", kPlace))
      add_shape(section, "floor_m", kFloorName, plane_shape({{0.0, 0.0, 1.0}, *height_m}, kHand),
                arm.workspace);
  }
  if (section.has("plane"))
    for (const Section& plane : section.tables("plane")) read_plane(plane, arm);
  if (section.has("box"))
    for (const Section& box : section.tables("box")) read_box(box, arm);
  for (const std::string_view key : {"floor_m", "plane", "box"}) {
    if (!section.has(key)) section.skip(key);
  }
  section.finish();
}

}  // namespace corbot
