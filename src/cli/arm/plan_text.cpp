// SPDX-License-Identifier: Apache-2.0
#include "cli/arm/plan_text.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cstddef>
#include <vector>

namespace corbot::cli {
namespace {

constexpr double kNear = 0.02;         // a pivot: nearer than this the task does not compare solutions
constexpr double kWorthSaying = 0.05;  // part of the time
constexpr double kMet = 0.9;           // a share at which a limit counts as met

std::string name_of(const rate::Reason& reason) {
  constexpr std::array kLimits{"speed", "acceleration", "jerk"};
  const char* limit = kLimits[static_cast<std::size_t>(reason.limit)];
  if (reason.mover == rate::Mover::kJoint) return fmt::format("joint {} {}", reason.joint, limit);
  return fmt::format("tool {}{}", reason.mover == rate::Mover::kToolTurn ? "turning " : "", limit);
}

/// Describes the limits of the part and their times.
std::string limits_text(const rate::PlanPart& part, client::Verb verb) {
  if (!part.moves_arm || part.duration_s <= 0.0) return "";
  struct Shown {
    std::string name;
    double begin_s, end_s;
  };
  std::vector<Shown> shown;  // equal limits around a stretch that is too short to name are merged
  bool follows_met = false;
  for (const rate::ReasonStretch& stretch : part.stretches) {
    if (stretch.end_s - stretch.begin_s < kWorthSaying * part.duration_s) continue;
    const bool is_met = stretch.share >= kMet;
    const std::string name = name_of(stretch.reason);
    if (is_met && (!follows_met || shown.back().name != name)) shown.push_back({name, stretch.begin_s, 0.0});
    if (is_met) shown.back().end_s = stretch.end_s;
    follows_met = is_met;
  }
  if (shown.empty()) return verb == client::Verb::kDrive ? "; the wanted speed" : "; the wanted time";
  // it needs no times
  const bool is_whole = shown.size() == 1 && shown[0].begin_s == 0.0 && shown[0].end_s == part.duration_s;
  if (is_whole) return "; " + shown[0].name;
  std::string text;
  for (const Shown& one : shown)
    text += fmt::format("{}{} {:.2f}-{:.2f} s", text.empty() ? "; " : ", ", one.name, one.begin_s, one.end_s);
  return text;
}

}  // namespace

std::vector<rate::PlanPart> parts_of(const Corbot::PlanInfo& plan) {
  std::vector<rate::PlanPart> parts;
  for (CORBA::ULong k = 0; k < plan.parts.length(); ++k) {
    const Corbot::PlanPart& from = plan.parts[k];
    rate::PlanPart& part = parts.emplace_back();
    part.duration_s = from.duration;
    part.moves_arm = true;
    for (CORBA::ULong i = 0; i < from.stretches.length(); ++i) {
      const Corbot::PlanStretch& stretch = from.stretches[i];
      const rate::Reason reason{static_cast<rate::Mover>(stretch.owner),
                                static_cast<std::size_t>(std::max<CORBA::Long>(stretch.articulation, 0)),
                                static_cast<rate::LimitKind>(stretch.limit)};
      part.stretches.push_back({reason, stretch.begin, stretch.end, 0.0, 0.0, stretch.share});
    }
    if (!from.hasPivot) continue;
    const Corbot::Point& p = from.pivotPoint;
    part.nearest = rate::NearestSingularity{from.leastPivot, 0.0, {p.x, p.y, p.z}};
  }
  return parts;
}

std::string plan_text(const std::vector<rate::PlanPart>& parts, client::Verb verb) {
  std::string text;
  for (const rate::PlanPart& part : parts) {
    text += fmt::format("  {:.2f} s{}", part.duration_s, limits_text(part, verb));
    if (part.nearest && part.nearest->pivot < kNear) {
      const auto& [x, y, z] = part.nearest->point_m;
      text += fmt::format("\n  nearest singularity: pivot {:.4f} at ({:.4g}, {:.4g}, {:.4g}) m",
                          part.nearest->pivot, x, y, z);
    }
    text += '\n';
  }
  return text;
}

}  // namespace corbot::cli
