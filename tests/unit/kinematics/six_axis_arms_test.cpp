// SPDX-License-Identifier: Apache-2.0
// Six-axis arms where solutions meet, or a joint is free.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>
#include <random>

#include "arm_vectors.h"
#include "corbot/kinematics/arm_kinematics.h"

namespace corbot::six_axis_arms_test {
namespace {

using test::arm_vectors;

constexpr double kPi = std::numbers::pi;
constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

Kinematics arm(const char* name) { return Kinematics::recognise(joint_chain(arm_vectors(name).table)); }
double apart(const Pose& a, const Pose& b) {
  return std::max(norm(a.position_m - b.position_m), angle_between(a.orientation, b.orientation));
}
void expect_all_come_back(const Kinematics& k, const Pose& pose, const SolutionSet& set, double bar) {
  for (const auto& [number, solution] : set) {
    EXPECT_LT(apart(k.forward(solution.joints_q), pose), bar) << "solution " << number;
  }
}

class SixAxes : public testing::TestWithParam<const char*> {
 protected:
  Kinematics arm_ = arm(GetParam());
};

TEST_P(SixAxes, SolveAllNumbersAtOnceAsOneByOne) {
  std::mt19937_64 random(1751);
  std::uniform_real_distribution<double> angle(-kPi, kPi);
  std::uint32_t refused = 0, solved = 0;
  for (int k = 0; k < 2000; ++k) {
    Joints q{}, hint{};
    for (double& joint : q) joint = angle(random);
    for (double& joint : hint) joint = 3.0 * angle(random);
    Pose pose = arm_.forward(q);
    if (k % 4 == 0) pose.position_m = 1.3 * pose.position_m;
    const SolutionSet set = arm_.solutions(pose, hint, 1e-9);
    std::uint32_t next = 0;
    for (std::uint32_t number = 0; number < 8; ++number) {
      const IkSolution one = arm_.inverse(pose, number, hint);
      if (one.status != IkStatus::kOk) {
        ++refused;
        continue;
      }
      ASSERT_LT(next, set.count);
      ASSERT_EQ(set.entries[next].number, number);
      for (std::size_t i = 0; i < 6; ++i) {
        ASSERT_NEAR(set.entries[next].solution.joints_q[i], one.joints_q[i], 1e-11);
        ASSERT_LE(std::abs(one.joints_q[i] - hint[i]), kPi + 1e-12);
      }
      ++next;
      ++solved;
    }
    ASSERT_EQ(next, set.count);
  }
  EXPECT_GT(refused, 1000u);
  EXPECT_GT(solved, 5000u);
}

TEST_P(SixAxes, GiveOneSolutionForTwoWhenStretched) {
  const Joints bent{0.3, -0.7, 0.9, 0.4, 0.8, -0.2};
  const double straight = arm_.visit([](const auto& form) {
    if constexpr (requires { form.links.sign3; }) {
      return form.links.sign3 * (form.links.upper_zero_rad - form.links.fore_zero_rad);
    } else {
      return kNaN;
    }
  });
  Joints q = bent;
  q[2] = straight;
  const Pose pose = arm_.forward(q);
  const SolutionSet set = arm_.solutions(pose, q, 1e-9);
  std::uint32_t here = 0;
  for (const auto& [number, solution] : set) {
    if (std::abs(wrap_angle(solution.joints_q[2] - q[2])) < 1e-6 &&
        std::abs(wrap_angle(solution.joints_q[0] - q[0])) < 1e-6 &&
        std::abs(wrap_angle(solution.joints_q[4] - q[4])) < 1e-6) {
      ++here;
      for (std::size_t i = 0; i < 6; ++i) EXPECT_NEAR(solution.joints_q[i], q[i], 2e-7) << "joint " << i;
    }
  }
  // Rounding may leave a bend of 1e-8, and two solutions with it.
  EXPECT_GE(here, 1u);
  expect_all_come_back(arm_, pose, set, 1e-12);
}

TEST_P(SixAxes, RefuseWhatIsOutOfReachAndSayByHowMuch) {
  const SolutionSet set = arm_.solutions({{3.0, 0.0, 0.5}, {}}, {}, 1e-9);
  EXPECT_EQ(set.count, 0u);
  EXPECT_EQ(set.refusal.status, IkStatus::kTooFar);
  EXPECT_GT(set.refusal.distance_m, set.refusal.limit_m);
  EXPECT_GT(set.refusal.limit_m, 0.5);
}

TEST_P(SixAxes, RefuseWhatIsNoNumber) {
  const Joints q{0.3, -0.7, 0.9, 0.4, 0.8, -0.2};
  const Pose good = arm_.forward(q);
  Pose bad = good;
  bad.position_m[1] = kNaN;
  EXPECT_EQ(arm_.inverse(bad, 0, q).status, IkStatus::kNotFinite);
  EXPECT_EQ(arm_.solutions(bad, q, 1e-9).refusal.status, IkStatus::kNotFinite);
  bad = good;
  bad.orientation = {0.0, 0.0, 0.0, 0.0};
  EXPECT_EQ(arm_.solutions(bad, q, 1e-9).count, 0u);
  for (std::size_t i = 0; i < 6; ++i) {
    Joints hint = q;
    hint[i] = kNaN;
    EXPECT_EQ(arm_.inverse(good, 0, hint).status, IkStatus::kNotFinite);
  }
  EXPECT_EQ(arm_.inverse(good, 8, q).status, IkStatus::kNoSolution);
}

INSTANTIATE_TEST_SUITE_P(Arms, SixAxes, testing::Values("puma560", "irb2400", "ur5e"));

TEST(OrthoParallelArm, KeepsJointFourWhereTheWristIsStraight) {
  for (const char* name : {"puma560", "irb2400"}) {
    const Kinematics k = arm(name);
    const double zero = std::get<OrthoParallelArm>(k.form()).wrist.middle_zero_rad;
    for (const double middle : {0.0, kPi}) {
      const Joints q{0.3, -0.7, 0.9, 0.4, middle - zero, -0.2};
      const Pose pose = k.forward(q);
      Joints hint = q;
      hint[3] = 1.1;
      const SolutionSet set = k.solutions(pose, hint, 1e-9);
      expect_all_come_back(k, pose, set, 1e-12);
      std::uint32_t kept = 0;
      for (const auto& [number, solution] : set) kept += solution.joints_q[3] == 1.1 ? 1 : 0;
      EXPECT_EQ(kept, 1u) << name;  // both flips are one
      const auto number = k.solution_of(q);
      ASSERT_TRUE(number.has_value());
      EXPECT_EQ(k.inverse(pose, *number, hint).joints_q[3], 1.1);
      // Sum or difference is made up for by joint 6.
      const Joints got = k.inverse(pose, *number, hint).joints_q;
      const double moved = wrap_angle(got[5] - q[5]);
      EXPECT_NEAR(std::abs(moved), 0.7, 1e-12);
    }
  }
}

TEST(OrthoParallelArm, KeepsItsDigitsNextToAStraightWrist) {
  const Kinematics k = arm("irb2400");
  for (double bend = 1e-14; bend < 0.1; bend *= 3.0) {
    const Joints q{0.3, 0.2, -0.4, 0.9, bend, -0.2};
    expect_all_come_back(k, k.forward(q), k.solutions(k.forward(q), {}, 1e-9), bend < 1e-12 ? 3e-13 : 2e-14);
  }
}

TEST(OrthoParallelArm, KeepsJointOneWhereTheWristIsOnItsAxis) {
  const Kinematics k = arm("irb2400");
  const auto& form = std::get<OrthoParallelArm>(k.form());
  Pose pose = form.mount.to_family(k.forward({0.3, 0.2, -0.4, 0.9, 0.5, -0.2})) * inverse_of(form.mount.hand);
  pose.position_m = {0.0, 0.0, 1.0};
  pose = form.mount.base * (pose * form.mount.hand);
  const SolutionSet set = k.solutions(pose, {0.77}, 1e-9);
  EXPECT_GE(set.count, 2u);
  for (const auto& [number, solution] : set) EXPECT_EQ(solution.joints_q[0], 0.77);
  expect_all_come_back(k, pose, set, 1e-12);
}

TEST(OrthoParallelArm, RefusesACentreNearerToAxisOneThanItsOffset) {
  const Kinematics k = arm("puma560");
  Pose pose = k.forward({0.3, -0.7, 0.9, 0.4, 0.8, -0.2});
  pose.position_m = {0.05, 0.05, 0.9};
  const IkSolution solution = k.inverse(pose, 0, {});
  EXPECT_EQ(solution.status, IkStatus::kTooClose);
  EXPECT_NEAR(solution.limit_m, 0.15005, 1e-12);
  EXPECT_NEAR(solution.distance_m, std::hypot(0.05, 0.05), 1e-12);
  EXPECT_EQ(k.solutions(pose, {}, 1e-9).count, 0u);
}

TEST(ParallelAxesArm, KeepsJointSixWhereAxesFourAndSixAreParallel) {
  const Kinematics k = arm("ur5e");
  for (const double middle : {0.0, kPi}) {
    const Joints q{0.3, -0.7, 0.9, 0.4, middle, -0.2};
    const Pose pose = k.forward(q);
    Joints hint = q;
    hint[5] = 0.05;
    const SolutionSet set = k.solutions(pose, hint, 1e-9);
    expect_all_come_back(k, pose, set, 1e-12);
    std::uint32_t kept = 0;
    for (const auto& [number, solution] : set) kept += solution.joints_q[5] == 0.05 ? 1 : 0;
    EXPECT_EQ(kept, 2u);  // elbow up and down; both flips are one
  }
}

TEST(ParallelAxesArm, TakesTheNearestJointSixThatReaches) {
  const Kinematics k = arm("ur5e");
  // Stretched: with joint 6 turned away axis 4 would be out of reach.
  const Joints q{0.3, -0.7, 0.02, 0.4, 0.0, -0.2};
  const Pose pose = k.forward(q);
  Joints hint = q;
  bool moved = false;
  for (const double away : {-1.5, -0.7, 0.7, 1.5}) {
    hint[5] = q[5] + away;
    const SolutionSet set = k.solutions(pose, hint, 1e-9);
    std::uint32_t here = 0;
    for (const auto& [number, solution] : set) {
      if (std::abs(wrap_angle(solution.joints_q[0] - q[0])) > 1e-9) continue;
      ++here;
      EXPECT_LE(std::abs(solution.joints_q[5] - hint[5]), std::abs(away) + 1e-9);
      moved = moved || std::abs(solution.joints_q[5] - hint[5]) > 0.01;
    }
    EXPECT_GE(here, 1u) << away;
    expect_all_come_back(k, pose, set, 1e-12);
  }
  EXPECT_TRUE(moved);
}

TEST(ParallelAxesArm, KeepsItsDigitsNextToParallelAxes) {
  const Kinematics k = arm("ur5e");
  for (double bend = 1e-14; bend < 0.1; bend *= 3.0) {
    const Joints q{0.3, -0.7, 0.9, 0.4, bend, -0.2};
    const SolutionSet set = k.solutions(k.forward(q), q, 1e-9);
    EXPECT_GE(set.count, 2u) << bend;
    expect_all_come_back(k, k.forward(q), set, bend < 1e-12 ? 3e-13 : 2e-14);
  }
}

TEST(ParallelAxesArm, RefusesACrossingNearerToAxisOneThanItsOffset) {
  const Kinematics k = arm("ur5e");
  const auto& form = std::get<ParallelAxesArm>(k.form());
  Pose pose = form.mount.to_family(k.forward({0.3, -0.7, 0.9, 0.4, 0.8, -0.2})) * inverse_of(form.mount.hand);
  pose.position_m = {0.05, 0.05, 0.5};
  const IkSolution solution = k.inverse(form.mount.base * (pose * form.mount.hand), 0, {});
  EXPECT_EQ(solution.status, IkStatus::kTooClose);
  EXPECT_NEAR(solution.limit_m, 0.1333, 1e-12);
}

}  // namespace
}  // namespace corbot::six_axis_arms_test
