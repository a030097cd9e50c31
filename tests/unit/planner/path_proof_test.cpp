// SPDX-License-Identifier: Apache-2.0
// The proof itself: what lies between the samples is found.
#include "planner/path_proof.h"

#include <gtest/gtest.h>

#include <cmath>

#include "test_arm.h"

namespace corbot::path_proof_test {
namespace {

using test::deg;

/// An arm that keeps its tool level.
const double kLevel_rad = angle_of_pitch(test::wide_arm().kinematics, 0.0);

TEST(PathProof, ARangeLeftBetweenTheSamplesIsFound) {
  // The elbow's angle has its greatest value amid the line, and off every early cut; the range ends a hair
  // below it.
  ArmModel arm = test::wide_arm();
  LineMotion line{};
  line.from_m = {0.25, -0.05, 0.1};
  line.to_m = {0.25, 0.0437, 0.1};
  const PathProof wide(arm, line, {});
  const double peak = wide.joints_at(0.05 / 0.0937).joints_q[2];
  for (const double hair : {1e-3, 1e-5, 5e-7}) {
    arm.joints[2].upper_q = peak - hair;
    const auto refusal = PathProof(arm, line, {}).check_geometry();
    ASSERT_TRUE(refusal.has_value()) << hair;
    EXPECT_EQ(refusal->joint, 2);
    EXPECT_NEAR(refusal->target_m[1], 0.0, 0.01);
    arm.joints[2].upper_q = peak + hair;
    EXPECT_FALSE(PathProof(arm, line, {}).check_geometry().has_value()) << hair;
  }
}

TEST(PathProof, ReachLeftByANanometreBetweenTheSamplesIsFound) {
  const ArmModel arm = test::wide_arm();
  ArcMotion arc{};
  arc.u = {std::cos(1.0), 0.0, -std::sin(1.0)};
  arc.v = {std::sin(1.0), 0.0, std::cos(1.0)};
  arc.radius_m = 0.03;
  arc.tool.from_angles_rad[0] = arc.tool.to_angles_rad[0] = kLevel_rad;
  arc.angle_rad = 1.77;  // farthest from the shoulder at s = 1/1.77
  for (const double hair_m : {1e-6, 1e-9, 1e-11}) {
    arc.centre_m = {0.1 + 0.21 + hair_m, 0.0, 0.067};
    const auto refusal = PathProof(arm, arc, {}).check_geometry();
    ASSERT_TRUE(refusal.has_value()) << hair_m;
    EXPECT_EQ(refusal->kind, PlanRefusal::Kind::kUnreachable);
    EXPECT_NEAR(refusal->target_m[2], 0.067, 1e-3);
    arc.centre_m[0] = 0.1 + 0.21 - hair_m;
    EXPECT_FALSE(PathProof(arm, arc, {}).check_geometry().has_value()) << hair_m;
  }
}

TEST(PathProof, AnArcAlongTheBorderIsRefusedInBoundedTime) {
  ArmModel arm = test::wide_arm();
  ArcMotion arc{};  // the stretched arm swings about its shoulder
  arc.centre_m = {0.1, 0.0, 0.067};
  arc.u = {1.0, 0.0, 0.0};
  arc.v = {0.0, 0.0, 1.0};
  arc.tool.from_angles_rad[0] = arc.tool.to_angles_rad[0] = kLevel_rad;
  arc.radius_m = 0.24;
  arc.angle_rad = 1.0;
  const auto refusal = PathProof(arm, arc, {}).check_geometry();
  ASSERT_TRUE(refusal.has_value());
  EXPECT_NE(refusal->kind, PlanRefusal::Kind::kBadParameter);
}

}  // namespace
}  // namespace corbot::path_proof_test
