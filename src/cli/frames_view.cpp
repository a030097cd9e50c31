// SPDX-License-Identifier: Apache-2.0
#include "cli/frames_view.h"

#include <fmt/format.h>

#include <nlohmann/json.hpp>

namespace corbot::cli {
namespace {

using client::Client;

std::string text_of(const Corbot::Pose& frame) {
  const auto& [p, q] = frame;
  return fmt::format("{:.6g} {:.6g} {:.6g} m, orientation {:.9g} {:.9g} {:.9g} {:.9g}", p.x, p.y, p.z, q.w,
                     q.x, q.y, q.z);
}

std::string solutions_text(const Corbot::PoseSolutions& solutions, long in_use) {
  std::string text;
  for (CORBA::ULong k = 0; k < solutions.length(); ++k) {
    const Corbot::PoseSolution& one = solutions[k];
    text += fmt::format("{:2}{}", one.number, static_cast<long>(one.number) == in_use ? "*" : " ");
    for (CORBA::ULong i = 0; i < one.joints.length(); ++i) text += fmt::format(" {:11.6f}", one.joints[i]);
    if (!one.withinLimits) text += "  beyond the limits";
    if (one.orientationError > 1e-4)
      text += fmt::format("  orientation {:.4g} degrees off", one.orientationError);
    text += '\n';
  }
  return text + (in_use >= 0 ? "* the solution in use\n" : "");
}

std::string solutions_json(const Corbot::PoseSolutions& solutions, long in_use) {
  nlohmann::json all = nlohmann::json::array();
  for (CORBA::ULong k = 0; k < solutions.length(); ++k) {
    const Corbot::PoseSolution& one = solutions[k];
    std::vector<double> joints(one.joints.get_buffer(), one.joints.get_buffer() + one.joints.length());
    all.push_back({{"number", one.number},
                   {"joints", joints},
                   {"within_limits", static_cast<bool>(one.withinLimits)},
                   {"orientation_error_deg", one.orientationError}});
  }
  nlohmann::json result{{"solutions", all}};
  result["in_use"] = in_use >= 0 ? nlohmann::json(in_use) : nlohmann::json();
  return result.dump() + "\n";
}

}  // namespace

std::string read_frames(Client& client) {
  const Corbot::Pose tool = client.call([](auto& arm) { return arm.ToolFrame(); });
  const Corbot::Pose base = client.call([](auto& arm) { return arm.BaseFrame(); });
  return fmt::format("tool  {}\nbase  {}\n", text_of(tool), text_of(base));
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
  return as_json ? solutions_json(all.in(), in_use) : solutions_text(all.in(), in_use);
}

}  // namespace corbot::cli
