// SPDX-License-Identifier: Apache-2.0
#include "cli/frames_view.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <limits>
#include <nlohmann/json.hpp>

#include "cli/joint_view.h"
#include "corbot/arm/shape_parts.h"

namespace corbot::cli {
namespace {

using client::Client;

std::string point_text(const Corbot::Point& at) {
  return fmt::format("{:.6g} {:.6g} {:.6g}", at.x, at.y, at.z);
}

/// Returns a line like "set      post  out of 0 0 0 to 1 1 1 m, for tool, wrist".
std::string shape_text(const Corbot::WorkspaceShape& shape, const char* origin) {
  std::string text = fmt::format("{:8} {}  ", origin, client::printable(shape.name.in()));
  if (shape.kind == Corbot::ShapePlane) {
    text += fmt::format("beyond {:.6g} m along {}", shape.offset, point_text(shape.normal));
  } else {
    text += fmt::format("{} {} to {} m", shape.kind == Corbot::ShapeInside ? "within" : "out of",
                        point_text(shape.least), point_text(shape.greatest));
  }
  return text + ", for " + part_names(shape.parts) + '\n';
}

struct Joint {
  std::string name;
  const char* unit;
  double lower, upper;  ///< soft limits; infinite if they are not known
};

std::vector<Joint> joints_of(Client& client) {
  const Corbot::JointList_var list = client.call([](auto& arm) { return arm.Joints(); });
  const Corbot::JointRanges_var limits = client.call([](auto& arm) { return arm.SoftLimits(); });
  constexpr double kNone = std::numeric_limits<double>::infinity();
  std::vector<Joint> joints;
  for (CORBA::ULong i = 0; i < list->length(); ++i) {
    const Corbot::JointInfo& info = list.in()[i];
    const Corbot::JointRange limit =
        i < limits->length() ? limits.in()[i] : Corbot::JointRange{-kNone, kNone};
    joints.push_back({client::printable(info.name.in()), info.kind == Corbot::JointSlides ? "m" : "degrees",
                      limit.lower, limit.upper});
  }
  return joints;
}

/// Returns the names of the joints that are beyond their limits.
std::vector<std::string> beyond(const Corbot::PoseSolution& one, const std::vector<Joint>& joints) {
  constexpr double kRounding = 1e-5;  // degrees or m, more than the planner's tolerance
  std::vector<std::string> names;
  for (CORBA::ULong i = 0; i < one.joints.length() && i < joints.size() && !one.withinLimits; ++i) {
    const double value = one.joints[i];
    if (value < joints[i].lower - kRounding || value > joints[i].upper + kRounding)
      names.push_back(joints[i].name);
  }
  return names;
}

std::string beyond_text(const Corbot::PoseSolution& one, const std::vector<Joint>& joints) {
  if (one.withinLimits) return "";
  const std::vector<std::string> names = beyond(one, joints);
  return fmt::format("  beyond the limits{}{}", names.empty() ? "" : ": ", fmt::join(names, ", "));
}

/// `is_asked`: the caller has given an orientation; else it is the tool's present one.
std::string solutions_text(const Corbot::PoseSolutions& solutions, long in_use,
                           const std::vector<Joint>& joints, bool is_asked) {
  std::size_t width = 11;
  for (const Joint& joint : joints) width = std::max(width, joint.name.size());
  std::string text = "   ";
  for (const Joint& joint : joints) text += fmt::format(" {:>{}}", joint.name, width);
  text += "\n   ";
  for (const Joint& joint : joints) text += fmt::format(" {:>{}}", joint.unit, width);
  text += '\n';
  for (CORBA::ULong k = 0; k < solutions.length(); ++k) {
    const Corbot::PoseSolution& one = solutions[k];
    text += fmt::format("{:2}{}", one.number, static_cast<long>(one.number) == in_use ? "*" : " ");
    for (CORBA::ULong i = 0; i < one.joints.length(); ++i)
      text += fmt::format(" {:{}.6f}", rounded(one.joints[i], 1e6), width);
    text += beyond_text(one, joints);
    if (one.orientationError > 1e-4)
      text += fmt::format("  orientation {:.4g} degrees {}", one.orientationError,
                          is_asked ? "off" : "from the present one");
    text += '\n';
  }
  return text + (in_use >= 0 ? "* the solution in use\n" : "");
}

std::string solutions_json(const Corbot::PoseSolutions& solutions, long in_use,
                           const std::vector<Joint>& joints) {
  nlohmann::json all = nlohmann::json::array();
  for (CORBA::ULong k = 0; k < solutions.length(); ++k) {
    const Corbot::PoseSolution& one = solutions[k];
    std::vector<double> values(one.joints.get_buffer(), one.joints.get_buffer() + one.joints.length());
    all.push_back({{"number", one.number},
                   {"joints", values},
                   {"within_limits", static_cast<bool>(one.withinLimits)},
                   {"beyond_limits", beyond(one, joints)},
                   {"orientation_error_deg", one.orientationError}});
  }
  nlohmann::json result{{"joints", nlohmann::json::array()}, {"solutions", all}};
  for (const Joint& joint : joints) result["joints"].push_back({{"name", joint.name}, {"unit", joint.unit}});
  result["in_use"] = in_use >= 0 ? nlohmann::json(in_use) : nlohmann::json();
  return result.dump() + "\n";
}

}  // namespace

std::string frame_text(const Corbot::Pose& frame) {
  const auto& [p, q] = frame;
  return fmt::format("{:.6g} {:.6g} {:.6g} m, orientation {:.9g} {:.9g} {:.9g} {:.9g}", p.x, p.y, p.z, q.w,
                     q.x, q.y, q.z);
}

std::string read_frames(Client& client) {
  const Corbot::Pose tool = client.call([](auto& arm) { return arm.ToolFrame(); });
  const Corbot::Pose base = client.call([](auto& arm) { return arm.BaseFrame(); });
  return fmt::format("tool  {}\nbase  {}\n", frame_text(tool), frame_text(base));
}

std::string read_workspace(Client& client) {
  const Corbot::WorkspaceInfo_var now = client.call([](auto& arm) { return arm.Workspace(); });
  std::string text;
  for (CORBA::ULong k = 0; k < now->profile.length(); ++k) text += shape_text(now->profile[k], "profile");
  for (CORBA::ULong k = 0; k < now->further.length(); ++k) text += shape_text(now->further[k], "set");
  if (!now->known)
    text +=
        "the planes and boxes that were set are not known, or hold for another base frame, which a motion's "
        "refusal names: set that frame, or --reset\n";
  return text.empty() ? "no planes and boxes: the arm may be anywhere\n" : text;
}

std::string read_solutions(Client& client, const std::vector<double>& pose, bool as_json) {
  Corbot::Pose target;
  if (pose.size() > 3) {
    target.orientation = {pose[3], pose[4], pose[5], pose[6]};
  } else {
    const Corbot::ArmState_var now = client.call([](auto& arm) { return arm.State(); });
    target.orientation = now->toolCommanded.orientation;
  }
  target.position = {pose[0], pose[1], pose[2]};
  const Corbot::PoseSolutions_var all = client.call([&](auto& arm) { return arm.Solutions(target); });
  const long in_use = client.call([](auto& arm) { return arm.Solution(); });
  const std::vector<Joint> joints = joints_of(client);
  return as_json ? solutions_json(all.in(), in_use, joints)
                 : solutions_text(all.in(), in_use, joints, pose.size() > 3);
}

}  // namespace corbot::cli
