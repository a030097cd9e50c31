// SPDX-License-Identifier: Apache-2.0
#include "cli/arm/doubts.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>
#include <utility>

#include "cli/arm/regularity.h"
#include "config/arms/doubts.h"
#include "corbot/units.h"

namespace corbot::cli {
namespace {

using config::ArmDescription;
using config::GeometryForm;

constexpr double kFlat_m = 1e-6;
constexpr double kSingularNearZero = 1e-6;

std::string convention_doubt(const ArmDescription& given) {
  const std::string other = config::other_reading(given.table, given.home_q);
  if (given.form != GeometryForm::kDh || other.empty()) return "";
  const bool is_standard = given.table.convention == DhConvention::kStandard;
  return fmt::format("geometry.dh = \"{}\" gives the family 'other', but {}",
                     is_standard ? "standard" : "modified", other);
}

/// Reports a joint that hardly turns: its range may be in radians.
std::string small_range_doubt(const std::string& joint, const JointLimits& limits) {
  const double furthest_deg = to_degrees(std::max(std::abs(limits.lower_q), std::abs(limits.upper_q)));
  if (furthest_deg <= 0.0 || furthest_deg > 2.0 * std::numbers::pi) return "";
  return fmt::format(
      "joint '{}': range_deg is within {:.3g} degrees of 0: radians? Then {:.3g} degrees are meant", joint,
      furthest_deg, to_degrees(furthest_deg));
}

/// Adds the angles of a joint that look like radians.
void add_radians(const Profile& profile, std::size_t joint, std::vector<std::string>& doubts) {
  if (profile.arm.kinematics.joint_kind(joint) != JointKind::kRotary) return;
  const DhRow& row = profile.description.table.rows[joint];
  const JointLimits& limits = profile.arm.joints[joint];
  const std::pair<const char*, double> angles[]{{"theta_deg", row.theta_rad},
                                                {"alpha_deg", row.alpha_rad},
                                                {"home_deg", profile.description.home_q[joint]},
                                                {"range_deg", limits.lower_q},
                                                {"range_deg", limits.upper_q}};
  const std::size_t before = doubts.size();
  for (const auto& [key, angle_rad] : angles) {
    const auto meant_deg = config::degrees_if_radians(angle_rad);
    if (!meant_deg) continue;
    doubts.push_back(fmt::format("joint '{}': {} {:.6g}: radians? Then {:g} degrees is meant",
                                 profile.joint_names[joint], key, to_degrees(angle_rad), *meant_deg));
  }
  std::string small = small_range_doubt(profile.joint_names[joint], limits);
  if (doubts.size() == before && !small.empty()) doubts.push_back(std::move(small));
}

/// Reports speeds and accelerations that no arm of such a controller reaches: they may be in millimetres.
std::vector<std::string> millimetre_doubts(const PathLimits& path) {
  constexpr double kFast_m_s = 10.0;
  constexpr double kFast_m_s2 = 200.0;
  std::vector<std::string> doubts;
  const auto look = [&doubts](const char* key, double value, double fast, const char* unit) {
    if (value > fast)
      doubts.push_back(fmt::format("path.{} = {:g} {}: millimetres? Then {:g} is meant", key, value, unit,
                                   value / 1000.0));
  };
  look("speed_m_s", path.speed_m_s, kFast_m_s, "m/s");
  look("acceleration_m_s2", path.acceleration_m_s2, kFast_m_s2, "m/s2");
  return doubts;
}

/// Reports a reach above 5 m, which the longest industrial arms do not have.
std::string centimetre_doubt(const ArmModel& arm) {
  constexpr double kLongest_m = 5.0;
  for (std::size_t i = 0; i < arm.dof; ++i) {
    if (arm.kinematics.joint_kind(i) != JointKind::kRotary) return "";
  }
  const double farthest_m = reach_m(arm);
  if (farthest_m <= kLongest_m) return "";
  return fmt::format("the arm reaches {:.3g} m: centimetres? Then {:.3g} m is meant", farthest_m,
                     farthest_m / 100.0);
}

/// Reports a flat workspace: an arm of three joints or more reaches a volume.
std::string flat_doubt(const ArmModel& arm, const Workspace& workspace) {
  if (arm.dof < 3) return "";
  for (std::size_t k = 0; k < 3; ++k) {
    const auto& [least_m, greatest_m] = workspace.extent_m[k];
    if (greatest_m - least_m < kFlat_m)
      return fmt::format("the workspace is flat: {} is {:.4f} m everywhere", "xyz"[k], least_m + 0.0);
  }
  return "";
}

std::string singular_doubt(const ArmModel& arm) {
  constexpr int kPlaces = 30;
  constexpr double kNear = 0.2;  // rad or m
  std::mt19937 random(1);
  std::uniform_real_distribution<double> unit(-1.0, 1.0);
  for (int n = 0; n < kPlaces; ++n) {
    Joints q{};
    for (std::size_t i = 0; i < arm.dof; ++i)
      q[i] = std::clamp(kNear * unit(random), arm.joints[i].lower_q, arm.joints[i].upper_q);
    if (regularity_at(arm.kinematics, q).smallest > kSingularNearZero) return "";
  }
  return "the arm is singular wherever its joints are near 0: two joints do the same";
}

}  // namespace

std::vector<std::string> doubts_of(const Profile& profile, const Workspace& workspace) {
  std::vector<std::string> doubts;
  const auto add = [&doubts](std::string text) {
    if (!text.empty()) doubts.push_back(std::move(text));
  };
  add(convention_doubt(profile.description));
  for (std::size_t i = 0; i < profile.arm.dof; ++i) add_radians(profile, i, doubts);
  for (std::string& doubt : millimetre_doubts(profile.arm.path)) add(std::move(doubt));
  add(centimetre_doubt(profile.arm));
  add(flat_doubt(profile.arm, workspace));
  add(singular_doubt(profile.arm));
  return doubts;
}

}  // namespace corbot::cli
