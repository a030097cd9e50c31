// SPDX-License-Identifier: Apache-2.0
#include "cli/arm/plan_text.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cstddef>
#include <variant>
#include <vector>

#include "planner/reasons.h"

namespace corbot::cli {
namespace {

constexpr double kNear = 0.02;         // a pivot: next to this the task does not compare solutions
constexpr double kWorthSaying = 0.05;  // part of the time
constexpr double kMet = 0.9;           // a share at which a limit counts as met
constexpr const char* kWantedTime = "; the wanted time";

std::string name_of(const rate::Reason& reason) {
  constexpr std::array kLimits{"speed", "acceleration", "jerk"};
  const char* limit = kLimits[static_cast<std::size_t>(reason.limit)];
  if (reason.mover == rate::Mover::kJoint) return fmt::format("joint {} {}", reason.joint, limit);
  return fmt::format("tool {}{}", reason.mover == rate::Mover::kToolTurn ? "turning " : "", limit);
}

std::string path_text(const ArmModel& model, const PlanSettings& settings, const Command& command,
                      const PlannedRate& rate) {
  struct Shown {
    std::string name;
    double begin_s, end_s;
  };
  std::vector<Shown> shown;  // equal ones around what is too short to name are one
  for (const rate::ReasonStretch& stretch : rate::reasons_of(model, settings, command, rate)) {
    if (stretch.share < kMet || stretch.end_s - stretch.begin_s < kWorthSaying * command.duration_s) continue;
    const std::string name = name_of(stretch.reason);
    if (shown.empty() || shown.back().name != name) shown.push_back({name, stretch.begin_s, 0.0});
    shown.back().end_s = stretch.end_s;
  }
  std::string text;
  for (const Shown& one : shown)
    text += fmt::format("{}{} {:.2f}-{:.2f} s", text.empty() ? "; " : ", ", one.name, one.begin_s, one.end_s);
  if (text.empty()) text = kWantedTime;
  const auto nearest = rate::nearest_singularity(model, command, rate.knots);
  if (nearest && nearest->pivot < kNear) {
    const auto& [x, y, z] = nearest->point_m;
    text += fmt::format("\n  nearest singularity: pivot {:.4f} at ({:.4g}, {:.4g}, {:.4g}) m", nearest->pivot,
                        x, y, z);
  }
  return text;
}

std::string reason_text(const ArmModel& model, const PlanSettings& settings, const Command& command,
                        const PlannedRate* rate) {
  if (command.duration_s <= 0.0) return "";
  if (rate != nullptr && !rate->pieces.empty()) return path_text(model, settings, command, *rate);
  if (command.kind != MotionKind::kJoint) return "";
  const auto reason = rate::reason_of(model, settings, command);
  return reason ? "; " + name_of(*reason) : kWantedTime;
}

}  // namespace

std::string plan_text(const ArmModel& model, const PlanSettings& settings, const PlanResult& plan) {
  const auto* commands = std::get_if<std::vector<Command>>(&plan);
  if (commands == nullptr) return "";
  std::string text;
  for (std::size_t k = 0; k < commands->size(); ++k) {
    const Command& command = (*commands)[k];
    const PlannedRate* rate = k < plan.rates.size() ? &plan.rates[k] : nullptr;
    text += fmt::format("  {:.2f} s{}\n", command.duration_s, reason_text(model, settings, command, rate));
  }
  return text;
}

}  // namespace corbot::cli
