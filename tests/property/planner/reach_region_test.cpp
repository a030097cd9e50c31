// SPDX-License-Identifier: Apache-2.0
// Tests the drawing of an arm's reach, over the shipped profiles.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <numbers>
#include <random>

#include "config/load_profile.h"
#include "planner/reach_region.h"
#include "planner/workspace.h"
#include "support/cases.h"
#include "support/paths.h"

namespace corbot {
namespace {

const DrawnPlane kAbove{{}, {1, 0, 0}, {0, 1, 0}};

/// Random joints, a third of them at an end of their range: there a region ends.
Joints joints_or_ends(const ArmModel& arm, std::mt19937_64& random) {
  std::uniform_real_distribution<double> unit(-0.25, 1.25);
  Joints q{};
  for (std::size_t i = 0; i < arm.dof; ++i) {
    const JointLimits& range = arm.joints[i];
    q[i] = range.lower_q + std::clamp(unit(random), 0.0, 1.0) * (range.upper_q - range.lower_q);
  }
  return q;
}

TEST(ReachRegion, HoldsEveryPositionOfEveryArm) {
  std::mt19937_64 random(test::seed());
  for (const auto& file : std::filesystem::directory_iterator(CORBOT_PROFILES)) {
    if (file.path().extension() != ".toml") continue;
    const ArmModel arm = load_profile(file.path()).arm;
    if (CORBOT_SANITIZED && arm.dof > 4) continue;  // takes a minute
    const double joint1_q = arm.joints[0].lower_q;
    const ReachRegion side = reach_region(arm, {}, joint1_q);
    const ReachRegion top = reach_region(arm, kAbove, std::nullopt);
    const int cases = test::cases(20'000);
    for (int i = 0; i < cases; ++i) {
      Joints q = joints_or_ends(arm, random);
      ASSERT_TRUE(top.contains(kAbove(arm.kinematics.forward(q).position_m))) << file.path();
      q[0] = joint1_q;
      ASSERT_TRUE(side.contains(DrawnPlane{}(arm.kinematics.forward(q).position_m))) << file.path();
    }
  }
}

ArmModel shipped(const char* name) {
  return load_profile(std::string(CORBOT_PROFILES) + "/" + name + ".toml").arm;
}

/// The least and the greatest distance of a marked cell's middle from a point, m.
std::array<double, 2> radii_of(const ReachRegion& region, const PlanePoint& about) {
  std::array<double, 2> radii{1e9, 0.0};
  for (std::size_t row = 0; row < region.rows; ++row) {
    for (std::size_t column = 0; column < region.columns; ++column) {
      if (!region.at(column, row)) continue;
      const double x = region.low_m[0] + (static_cast<double>(column) + 0.5) * region.cell_m - about[0];
      const double y = region.low_m[1] + (static_cast<double>(row) + 0.5) * region.cell_m - about[1];
      radii = {std::min(radii[0], std::hypot(x, y)), std::max(radii[1], std::hypot(x, y))};
    }
  }
  return radii;
}

TEST(ReachRegion, EndsWhereTheReachEnds) {
  for (const char* name :
       {"lynx5", "scara_gx4", "cylindrical_rpp", "polar_rrp", "puma560", "so101", "xarm6"}) {
    const ArmModel arm = shipped(name);
    if (CORBOT_SANITIZED && arm.dof > 4) continue;
    const Workspace space = workspace_of(arm);
    const ReachRegion top = reach_region(arm, kAbove, std::nullopt);
    const auto radii = radii_of(top, kAbove(space.axis_m));
    EXPECT_NEAR(radii[1], space.radius_m[1], 5.0 * top.cell_m) << name;
    EXPECT_NEAR(radii[0], space.radius_m[0], 5.0 * top.cell_m) << name;
  }
}

/// Two links of 0.22 m and 0.13 m, elbow within 142 degrees of straight: a ring, its inner radius by the
/// cosine rule.
TEST(ReachRegion, LeavesTheHoleOfAScara) {
  const ReachRegion top = reach_region(shipped("scara_gx4"), kAbove, std::nullopt);
  const double bend_rad = 142.0 * std::numbers::pi / 180.0;
  const double inner_m = std::sqrt(0.22 * 0.22 + 0.13 * 0.13 + 2.0 * 0.22 * 0.13 * std::cos(bend_rad));
  EXPECT_NEAR(radii_of(top, {})[0], inner_m, 5.0 * top.cell_m);
}

/// A gantry's region is its ranges' rectangle, at most two cells larger on each side.
TEST(ReachRegion, OfAGantryIsARectangle) {
  const ReachRegion top = reach_region(shipped("cartesian_ppp"), kAbove, std::nullopt);
  const auto marked = static_cast<double>(std::count(top.marked.begin(), top.marked.end(), 1));
  const double area_m2 = 0.4772 * 0.4938;
  EXPECT_GE(marked * top.cell_m * top.cell_m, area_m2);
  EXPECT_LE(marked * top.cell_m * top.cell_m, (0.4772 + 4.0 * top.cell_m) * (0.4938 + 4.0 * top.cell_m));
}

}  // namespace
}  // namespace corbot
