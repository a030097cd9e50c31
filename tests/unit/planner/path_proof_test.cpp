// SPDX-License-Identifier: Apache-2.0
// The proof itself: no bound may lie below what dense sampling finds, nor far above it.
#include "planner/path_proof.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>

#include "corbot/motion/law_evaluation.h"
#include "planner/time_law_planner.h"
#include "test_arm.h"

namespace corbot::path_proof_test {
namespace {

using test::deg;

/// An arm that keeps its tool level.
const double kLevel_rad = angle_of_pitch(test::wide_arm().kinematics, 0.0);

LineMotion random_line(std::mt19937_64& random) {
  std::uniform_real_distribution<double> unit(-1.0, 1.0);
  LineMotion line{};
  for (std::size_t i = 0; i < 3; ++i) {
    line.from_m[i] = 0.25 * unit(random);
    line.to_m[i] = line.from_m[i] + 0.1 * unit(random);
  }
  line.tool.from_angles_rad[0] = kLevel_rad + unit(random);
  line.tool.to_angles_rad[0] = line.tool.from_angles_rad[0] + 0.5 * unit(random);
  return line;
}

TEST(PathProof, TheLoadIsAboveEverySampleAndLessThanOnePerCentHigher) {
  constexpr std::uint64_t kSeed = 99;
  std::cout << "seed " << kSeed << "\n";
  std::mt19937_64 random(kSeed);
  const ArmModel arm = test::wide_arm();
  Joints speed{};
  for (std::size_t i = 0; i < 4; ++i) speed[i] = arm.joints[i].speed_q_s;
  int compared = 0;
  for (int n = 0; n < 400; ++n) {
    LineMotion line = random_line(random);
    line.solution = static_cast<std::uint32_t>(n % 4);
    const PathProof proof(arm, line, {});
    if (proof.check_geometry()) continue;
    const TimeLaw law = plan_law(1.0, {3.0, 20.0, 200.0});
    const double load = proof.load(law, speed, 0.0);
    ASSERT_TRUE(std::isfinite(load));
    double sampled = 0.0;
    constexpr int kSamples = 4000;
    Joints last = proof.joints_at(0.0).joints_q;
    for (int k = 1; k <= kSamples; ++k) {
      const Joints now = proof.joints_at(evaluate(law, law.duration_s() * k / kSamples).position).joints_q;
      for (std::size_t i = 0; i < 4; ++i) {
        sampled = std::max(sampled, std::abs(now[i] - last[i]) * kSamples / law.duration_s() / speed[i]);
      }
      last = now;
    }
    ASSERT_GE(load * (1.0 + 1e-9), sampled) << "case " << n;
    ASSERT_LE(load, 1.0101 * sampled * 1.01) << "case " << n;  // sampling itself misses a little
    ++compared;
  }
  EXPECT_GT(compared, 40);
}

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
