// SPDX-License-Identifier: Apache-2.0
#include "config/geometry_schema.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <string_view>
#include <utility>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "config/arms/arm_kind.h"
#include "config/arms/doubts.h"
#include "config/arms/recognise.h"
#include "config/arms/roll_pitch_yaw.h"
#include "config/joint_keys.h"
#include "corbot/kinematics/tool_pose.h"
#include "corbot/motion/frames.h"
#include "corbot/units.h"

namespace corbot {
namespace {

using config::GeometryForm;

constexpr Bounds kLength{0, 5, true, "m"};
constexpr Bounds kTurn{-360, 360, false, "degrees"};
constexpr Bounds kDistance{-10, 10, false, "m"};
/// Tolerance of a quaternion's length: few digits cause such an error.
constexpr double kUnitLength = 1e-3;

/// Returns a number, or 0 after noting that the geometry is not complete.
double read_part(Section& section, std::string_view key, const Bounds& bounds, bool& is_complete) {
  const auto value = section.number(key, bounds);
  is_complete = is_complete && value.has_value();
  return value.value_or(0);
}

void read_lengths(Section& section, GeometryInput& input) {
  config::FourAxisLengths& lengths = input.lengths;
  lengths.l0_m = read_part(section, "l0_m", {0, 5, false, "m"}, input.is_complete);
  lengths.l1_m = read_part(section, "l1_m", kLength, input.is_complete);
  lengths.l2_m = read_part(section, "l2_m", kLength, input.is_complete);
  lengths.l3_m = read_part(section, "l3_m", kLength, input.is_complete);
  if (const auto offset = section.numbers("offset_deg", lengths.offset_rad.size(), kHalfTurn_deg)) {
    for (std::size_t i = 0; i < offset->size(); ++i) lengths.offset_rad[i] = (*offset)[i] * kRadiansPerDegree;
  } else {
    input.is_complete = false;
  }
}

void read_convention(Section& section, GeometryInput& input) {
  const auto convention = section.text("dh");
  if (convention == "modified") input.convention = DhConvention::kModified;
  if (convention && *convention != "standard" && *convention != "modified") {
    section.refuse(
        "dh",
        "must be \"standard\" (distal: theta, d, a, alpha) or \"modified\" (proximal, Craig's: alpha "
        "and a of the link before)");
    input.is_complete = false;
  }
  input.is_complete = input.is_complete && convention.has_value();
}

void read_chain(Section& section, const std::string& profile_file, GeometryInput& input) {
  const auto urdf = section.text("urdf");
  const auto base = section.text("base_link");
  const auto tip = section.text("tip_link");
  input.is_complete = urdf && base && tip;
  if (!input.is_complete) return;
  input.urdf_file = is_urdf_text(*urdf) ? "inline" : *urdf;
  try {
    const std::string xml = read_urdf(*urdf, profile_file);
    input.urdf = config::read_urdf_chain(xml, *base, *tip);
    const std::string degrees = config::rotation_in_degrees(xml);
    if (!degrees.empty())
      throw config::UrdfError(
          fmt::format("has rpy=\"{}\", which looks like degrees: write radians in a URDF", degrees));
  } catch (const config::UrdfError& error) {
    section.refuse("urdf", error.what());
    input.is_complete = false;
  }
}

Quaternion read_orientation(Section& section, bool& is_complete) {
  for (const std::string_view key : {"rpy_deg", "quaternion_wxyz"}) {
    if (!section.has(key)) section.skip(key);
  }
  if (section.has("rpy_deg") && section.has("quaternion_wxyz")) {
    section.refuse("quaternion_wxyz", "contradicts rpy_deg: write only one of the two");
    is_complete = false;
  }
  if (section.has("quaternion_wxyz")) {
    const auto parts = section.numbers("quaternion_wxyz", 4, {-1, 1, false, ""});
    if (section.has("rpy_deg")) section.skip("rpy_deg");
    is_complete = is_complete && parts.has_value();
    if (!parts) return {};
    const Quaternion q{(*parts)[0], (*parts)[1], (*parts)[2], (*parts)[3]};
    if (std::abs(std::sqrt(squared_norm(q)) - 1.0) <= kUnitLength) return normalised(q);
    section.refuse("quaternion_wxyz",
                   "must have length 1: divide its four numbers by the root of the sum of their squares");
    is_complete = false;
    return {};
  }
  if (!section.has("rpy_deg")) return {};
  const auto angles = section.numbers("rpy_deg", 3, kTurn);
  is_complete = is_complete && angles.has_value();
  if (!angles) return {};
  return config::to_quaternion(
      {to_radians((*angles)[0]), to_radians((*angles)[1]), to_radians((*angles)[2])});
}

/// Reads `[base]` or `[tool]`, within the bounds that the real-time task accepts for a path's frames.
Pose read_frame(Section section, double farthest_m, bool& is_complete) {
  Pose frame;
  if (!section.has("position_m")) {
    section.skip("position_m");
  } else {
    const auto position = section.numbers("position_m", 3, {-farthest_m, farthest_m, false, "m"});
    is_complete = is_complete && position.has_value();
    if (position) frame.position_m = {(*position)[0], (*position)[1], (*position)[2]};
  }
  frame.orientation = read_orientation(section, is_complete);
  section.finish();
  return frame;
}

JointKind read_kind(Section& joint, bool& is_complete) {
  const auto kind = joint.text_or("kind", "turning");
  if (kind == "sliding") return JointKind::kPrismatic;
  if (kind == "turning") return JointKind::kRotary;
  if (kind) joint.refuse("kind", "must be \"turning\" or \"sliding\"");
  is_complete = false;
  return joint.has(keys_of(JointKind::kPrismatic).range) ? JointKind::kPrismatic : JointKind::kRotary;
}

DhRow read_row(Section row, JointKind kind, bool& is_complete) {
  is_complete = is_complete && row.present();
  DhRow read{kind};
  read.theta_rad = to_radians(read_part(row, "theta_deg", kTurn, is_complete));
  read.d_m = read_part(row, "d_m", kDistance, is_complete);
  read.a_m = read_part(row, "a_m", kDistance, is_complete);
  read.alpha_rad = to_radians(read_part(row, "alpha_deg", kTurn, is_complete));
  row.finish();
  return read;
}

/// Checks that robot.kind, if given, is the recognised kind.
void check_kind(Section& robot, const Kinematics& kinematics, const config::ArmDescription& description,
                ArmKind& kind) {
  const ArmKind found = config::kind_of(kinematics);
  kind = found;
  const auto given = robot.text_or("kind", std::string(config::name_of(found)));
  if (!given || *given == config::name_of(found)) return;
  const auto& names = config::kKindNames;
  if (std::find(names.begin(), names.end(), *given) == names.end()) {
    robot.refuse("kind", fmt::format("is no kind of arm; allowed here: \"{}\"", config::name_of(found)));
    return;
  }
  std::string text = fmt::format("must be \"{}\", or left out: the geometry belongs to the family '{}'",
                                 config::name_of(found), kinematics.family());
  const std::string other = description.form == GeometryForm::kDh
                                ? config::other_reading(description.table, description.home_q)
                                : "";
  for (const std::string& more : {other, description.reason}) text += more.empty() ? "" : "; " + more;
  robot.refuse("kind", text);
}

/// Refuses an orientation error for four or five joints without a closed form: the search finds only exact
/// poses, not the nearest orientation.
void check_orientation_error(Section& robot, const Kinematics& kinematics, double orientation_error_rad) {
  const std::uint32_t joints = kinematics.chain().count;
  if (orientation_error_rad == 0.0 || kinematics.has_closed_form() || (joints != 4 && joints != 5)) return;
  robot.refuse("orientation_error_deg",
               fmt::format("must be 0, or be left out: an arm of {} joints without a closed form "
                           "moves only to orientations that it can take",
                           joints));
}

}  // namespace

bool is_urdf_text(const std::string& file_or_text) {
  const std::size_t first = file_or_text.find_first_not_of(" \t\r\n");
  return first != std::string::npos && file_or_text[first] == '<';
}

std::string read_urdf(const std::string& file_or_text, const std::string& profile_file) {
  if (is_urdf_text(file_or_text)) return file_or_text;
  const std::filesystem::path file = std::filesystem::path(profile_file).parent_path() / file_or_text;
  std::error_code error;
  if (!std::filesystem::is_regular_file(file, error)) {
    throw config::UrdfError(fmt::format(
        "does not exist or is no file: {} (a relative path begins at the profile's folder)", file.string()));
  }
  std::ifstream stream{file, std::ios::binary};
  std::string text(kMaxUrdfBytes + 1, '\0');
  stream.read(text.data(), static_cast<std::streamsize>(text.size()));
  text.resize(static_cast<std::size_t>(stream.gcount()));
  if (text.empty() || stream.bad()) throw config::UrdfError(fmt::format("cannot be read: {}", file.string()));
  if (text.size() > kMaxUrdfBytes)
    throw config::UrdfError(fmt::format("is larger than {} bytes", kMaxUrdfBytes));
  return text;
}

GeometryInput read_geometry(Section& root, Section section, const std::string& profile_file) {
  GeometryInput input;
  input.is_complete = section.present();
  if (section.has("urdf")) {
    input.form = GeometryForm::kUrdf;
    if (section.has("dh")) {
      (void)section.text("dh");
      section.refuse("dh", "contradicts urdf: write only one of the two");
    }
    read_chain(section, profile_file, input);
  } else if (section.has("dh")) {
    input.form = GeometryForm::kDh;
    read_convention(section, input);
  } else {
    read_lengths(section, input);
    section.skip("dh");
    section.skip("urdf");
  }
  section.finish();
  if (input.form == GeometryForm::kLengths) {
    for (const std::string_view key : {"base", "tool"}) {
      if (!root.has(key)) continue;
      (void)root.table(key);
      root.refuse(key, "needs the key dh or urdf in [geometry]");
    }
    return input;
  }
  input.base_T_0 = read_frame(root.table_or_empty("base"), kFarthestBase_m, input.is_complete);
  input.n_T_tool = read_frame(root.table_or_empty("tool"), kFarthestTool_m, input.is_complete);
  return input;
}

std::size_t joints_of(const GeometryInput& input) {
  if (input.form == GeometryForm::kLengths) return input.lengths.offset_rad.size();
  return input.form == GeometryForm::kUrdf ? input.urdf.chain.count : 0;
}

JointKind read_joint_geometry(Section& joint, std::size_t index, GeometryInput& input) {
  if (input.form == GeometryForm::kLengths) return JointKind::kRotary;
  JointKind kind = input.urdf.chain.axes[index].kind;
  if (input.form == GeometryForm::kDh) {
    kind = read_kind(joint, input.is_complete);
    input.rows[index] = read_row(joint.table("dh"), kind, input.is_complete);
  } else if (input.urdf.chain.count == 0) {
    // An unreadable URDF must not be reported key by key.
    kind = joint.has(keys_of(JointKind::kPrismatic).range) ? JointKind::kPrismatic : JointKind::kRotary;
  }
  const JointKeys& keys = keys_of(kind);
  const std::string does = kind == JointKind::kRotary ? "turns" : "slides";
  keys.refuse_others(
      joint,
      input.form == GeometryForm::kUrdf
          ? fmt::format("\"{}\" {} in the URDF", input.urdf.joints[index].name, does)
          : fmt::format("the joint {}, by its key kind, which is \"turning\" if it is left out", does));
  const auto home = joint.number_or(keys.home, 0, keys.value);
  input.is_complete = input.is_complete && home.has_value();
  input.home_q[index] = home.value_or(0) * keys.si_per_unit;
  return kind;
}

void recognise_geometry(Section& robot, Section& geometry, const GeometryInput& input, std::size_t joints,
                        Profile& profile) {
  if (!input.is_complete) {
    (void)robot.text_or("kind", "");
    return;
  }
  config::ArmDescription& description = profile.description;
  description.form = input.form;
  description.home_q = input.home_q;
  config::RecognisedArm arm;
  if (input.form == GeometryForm::kUrdf) {
    description.urdf = input.urdf_file;
    description.given = input.urdf.chain;
    description.given.base_T_0 = input.base_T_0;
    description.given.n_T_tool = input.n_T_tool;
    arm = config::recognise_arm(config::at_home(description.given, input.home_q));
  } else {
    description.table = input.form == GeometryForm::kLengths
                            ? config::four_axis_table(input.lengths)
                            : DhTable{static_cast<std::uint32_t>(joints), input.rows, input.base_T_0,
                                      input.n_T_tool, input.convention};
    description.given = joint_chain(description.table);
    arm = config::recognise_arm(config::at_home(description.table, input.home_q));
  }
  description.reason = arm.reason;
  description.difference_m = arm.difference_m;
  description.difference_rad = arm.difference_rad;
  if (input.form == GeometryForm::kLengths && !has_tool_pitch(arm.kinematics)) {
    geometry.refuse("l1_m", "gives no arm with a base axis and a planar arm: " + arm.reason);
  }
  profile.arm.kinematics = arm.kinematics;
  check_kind(robot, arm.kinematics, description, profile.arm.kind);
  check_orientation_error(robot, arm.kinematics, profile.arm.orientation_error_rad);
}

}  // namespace corbot
