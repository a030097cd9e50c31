// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>
#include <random>

#include "arm_vectors.h"
#include "corbot/kinematics/arm_kinematics.h"
#include "paper_equations.h"

namespace corbot::arm_kinematics_test {
namespace {

using test::arm_vectors;

constexpr double kPi = std::numbers::pi;
constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

Kinematics arm(const char* name) { return Kinematics::recognise(joint_chain(arm_vectors(name).table)); }
double apart(const Pose& a, const Pose& b) {
  return std::max(norm(a.position_m - b.position_m), angle_between(a.orientation, b.orientation));
}

/// Yaw and pitch as the paper has them.
Quaternion yaw_pitch(double yaw_rad, double pitch_rad) {
  return about({0.0, 0.0, 1.0}, yaw_rad) * about({0.0, -1.0, 0.0}, pitch_rad);
}

TEST(PlanarArm, IsThePapersArmOnEverySolution) {
  const paper::Arm lynx{0.06731, 0.14605, 0.187325, 0.100, {0.0, kPi / 18, 0.0, -kPi / 4}};
  const Kinematics same = arm("al5d");
  std::mt19937_64 random(1751);
  std::uniform_real_distribution<double> angle(-kPi, kPi);
  int compared = 0;
  for (int k = 0; k < 20'000; ++k) {
    const Joints q{angle(random), angle(random), angle(random), angle(random)};
    const paper::Pose printed = paper::forward(lynx, q);
    const Pose pose = same.forward(q);
    ASSERT_LT(apart(pose, {printed.position_m, yaw_pitch(printed.yaw_rad, printed.pitch_rad)}), 1e-14);
    for (std::uint32_t n = 0; n < same.solution_count(); ++n) {
      const paper::Inverse expected = paper::inverse(lynx, printed.position_m, printed.pitch_rad, n);
      // Backward, the pitch is the same with the base the other way round.
      const double yaw =
          std::atan2(printed.position_m[1], printed.position_m[0]) + (paper::is_backward(n) ? kPi : 0.0);
      const IkSolution got = same.inverse({printed.position_m, yaw_pitch(yaw, printed.pitch_rad)}, n, {});
      ASSERT_EQ(got.status, expected.status);
      if (got.status != IkStatus::kOk) {
        ASSERT_NEAR(got.distance_m, expected.wrist_m, 1e-14);
        ASSERT_EQ(got.limit_m,
                  got.status == IkStatus::kTooFar ? lynx.l1_m + lynx.l2_m : lynx.l2_m - lynx.l1_m);
        continue;
      }
      ++compared;
      ASSERT_LT(got.orientation_error_rad, 1e-14);
      const double slack = 1e-15 / (1e-9 + std::abs(std::sin(expected.joints_q[2])));
      for (std::size_t i = 0; i < 4; ++i) {
        ASSERT_NEAR(wrap_angle(got.joints_q[i] - expected.joints_q[i]), 0.0, 1e-12 + slack) << "joint " << i;
      }
    }
  }
  EXPECT_GT(compared, 20'000);
}

TEST(PlanarArm, TakesTheHeadingFromTheOrientationOnItsAxis) {
  for (const char* name : {"omx", "al5d_wr"}) {
    const Kinematics k = arm(name);
    Pose pose = k.forward(arm_vectors(name).table.count == 4 ? Joints{0.7, -0.4, 0.3, 0.5}
                                                             : Joints{0.7, 1.2, -0.9, 0.4, 0.3});
    const Pose base = k.chain().base_T_0;
    pose.position_m[0] = base.position_m[0];
    pose.position_m[1] = base.position_m[1];
    int found = 0;
    for (const auto& [number, solution] : k.solutions(pose, {3.0}, 1e-9)) {
      EXPECT_LT(apart(k.forward(solution.joints_q), pose), 1e-12) << name << " " << number;
      ++found;
    }
    EXPECT_GT(found, 0) << name;
  }
}

TEST(PlanarArm, KeepsTheHintOnItsAxisWhereTheToolPointsStraightUp) {
  const Kinematics k = arm("al5d_wr");
  const Joints hint{0.3, 1.5, -0.2, 0.1, 0.4};
  Pose pose = k.forward({0.3, kPi / 2, 0.0, 0.0, 0.0});
  pose.position_m = {0.0, -0.02, 0.40};
  // x of this tool is along the hand: upright.
  pose.orientation = about({0.0, 1.0, 0.0}, -kPi / 2);
  for (const auto& [number, solution] : k.solutions(pose, hint, 1e-9)) {
    EXPECT_EQ(solution.joints_q[0], 0.3) << number;
    EXPECT_LT(apart(k.forward(solution.joints_q), pose), 1e-12);
  }
  EXPECT_GT(k.solutions(pose, hint, 1e-9).count, 0u);
}

TEST(PlanarArm, GivesOneSolutionForTwoWhenStretched) {
  const Kinematics k = arm("al5d");
  const Pose pose = k.forward({0.2, 0.5, 0.0, 0.3});
  EXPECT_EQ(k.solutions(pose, {}, 1e-9).count, 1u);
  EXPECT_EQ(k.solutions(k.forward({0.2, 0.5, 1e-3, 0.3}), {}, 1e-9).count, 2u);
}

TEST(PlanarArm, SaysHowFarIsTooFar) {
  const Kinematics k = arm("al5d");
  const IkSolution far = k.inverse({{0.6, 0.0, 0.06731}, {}}, 0, {});
  EXPECT_EQ(far.status, IkStatus::kTooFar);
  EXPECT_NEAR(far.distance_m, 0.5, 1e-12);
  EXPECT_NEAR(far.limit_m, 0.333375, 1e-12);
  const IkSolution near = k.inverse({{0.12, 0.0, 0.06731}, {}}, 0, {});
  EXPECT_EQ(near.status, IkStatus::kTooClose);
  EXPECT_NEAR(near.limit_m, 0.041275, 1e-12);
  EXPECT_EQ(k.solutions({{0.6, 0.0, 0.06731}, {}}, {}, kPi).refusal.status, IkStatus::kTooFar);
}

TEST(PlanarArm, KeepsItsPositionAndTellsTheErrorOfAnOrientation) {
  const Kinematics k = arm("omx");
  const Pose pose = k.forward({0.4, -0.3, 0.5, 0.2});
  for (const double tilt : {0.01, 0.5, 1.5}) {
    const Pose tilted{pose.position_m, pose.orientation * about({1.0, 0.0, 0.0}, tilt)};
    const IkSolution solution = k.inverse(tilted, *k.solution_of({0.4, -0.3, 0.5, 0.2}), {});
    ASSERT_EQ(solution.status, IkStatus::kOk);
    EXPECT_NEAR(solution.orientation_error_rad, tilt, 1e-12);
    EXPECT_LT(norm(k.forward(solution.joints_q).position_m - pose.position_m), 1e-12);
  }
  EXPECT_EQ(k.solutions({pose.position_m, pose.orientation * about({1.0, 0.0, 0.0}, 0.01)}, {}, 1e-6).count,
            0u);
}

TEST(PlanarArm, KeepsThePresentHandWhereEveryDirectionIsAsWrong) {
  const Kinematics k = arm("al5d_wr");
  const Joints q{0.4, 1.0, -0.9, 0.3, 0.2};
  const Pose pose = k.forward(q);
  // The hand's axis (x) square to the arm's plane.
  const Quaternion across = about({0.0, 0.0, 1.0}, kPi / 2) *
                            about({0.0, 0.0, 1.0}, std::atan2(pose.position_m[1] + 0.02, pose.position_m[0]));
  const IkSolution solution = k.inverse({pose.position_m, across}, *k.solution_of(q), q);
  ASSERT_EQ(solution.status, IkStatus::kOk);
  EXPECT_NEAR(solution.orientation_error_rad, kPi / 2, 1e-12);
  EXPECT_LT(norm(k.forward(solution.joints_q).position_m - pose.position_m), 1e-12);
  for (std::size_t i = 0; i < 4; ++i) EXPECT_NEAR(solution.joints_q[i], q[i], 1e-9);
}

TEST(ScaraArm, KeepsTheHintWhereItIsFoldedOntoItsAxis) {
  DhTable table = arm_vectors("scara_gx4").table;
  table.rows[1].a_m = table.rows[0].a_m;
  const Kinematics k = Kinematics::recognise(joint_chain(table));
  const Joints q{0.7, kPi, -0.1, 0.2};
  const SolutionSet set = k.solutions(k.forward(q), q, 1e-9);
  ASSERT_EQ(set.count, 1u);
  for (std::size_t i = 0; i < 4; ++i) EXPECT_NEAR(set.entries[0].solution.joints_q[i], q[i], 1e-9);
}

TEST(ScaraArm, TakesTheYawOfATiltedTool) {
  const Kinematics k = arm("scara_gx4");
  const Joints q{0.3, 0.8, -0.1, 0.2};
  Pose pose = k.forward(q);
  pose.orientation = pose.orientation * about({1.0, 0.0, 0.0}, 0.25);
  const IkSolution solution = k.inverse(pose, *k.solution_of(q), q);
  EXPECT_NEAR(solution.orientation_error_rad, 0.25, 1e-12);
  EXPECT_LT(norm(k.forward(solution.joints_q).position_m - pose.position_m), 1e-12);
}

TEST(CylindricalArm, KeepsTheHintOnItsAxis) {
  DhTable table = arm_vectors("cylindrical_rppr").table;
  table.rows[2].theta_rad = 0.0;
  table.rows[1].a_m = 0.0;  // no lateral offset
  const Kinematics k = Kinematics::recognise(joint_chain(table));
  ASSERT_STREQ(k.family(), CylindricalArm::kName);
  Pose pose = k.forward({0.9, 0.2, 0.3, 0.4});
  pose.position_m[0] = pose.position_m[1] = 0.0;
  const SolutionSet set = k.solutions(pose, {1.1, 0.0, 0.0, 0.0}, 1e-9);
  ASSERT_EQ(set.count, 1u) << "in front of and behind the axis are the same there";
  EXPECT_EQ(set.entries[0].solution.joints_q[0], 1.1);
  EXPECT_LT(apart(k.forward(set.entries[0].solution.joints_q), pose), 1e-12);
}

TEST(PolarArm, KeepsTheHintWhereTheSlideIsUprightOnTheAxis) {
  DhTable table = arm_vectors("polar_rrp").table;
  table.rows[1].d_m = 0.0;
  table.rows[2].a_m = 0.0;
  const Kinematics k = Kinematics::recognise(joint_chain(table));
  const Joints q{0.8, 0.0, 0.5};
  const SolutionSet set = k.solutions(k.forward(q), q, kPi);
  ASSERT_GT(set.count, 0u);
  EXPECT_EQ(set.entries[0].solution.joints_q[0], 0.8);
}

TEST(PolarArm, KeepsTheHintsOfASingularWrist) {
  const Kinematics k = arm("stanford");
  const Joints q{0.8, 0.6, 0.5, 0.3, 0.0, 0.9};
  Joints hint = q;
  hint[3] = 0.5;
  const SolutionSet set = k.solutions(k.forward(q), hint, 1e-9);
  // The arm has four postures; two have a straight wrist, whose two ways to bend are one.
  EXPECT_EQ(set.count, 6u);
  bool found = false;
  for (const auto& [number, solution] : set) {
    if (std::abs(solution.joints_q[0] - q[0]) > 1e-9 || std::abs(solution.joints_q[1] - q[1]) > 1e-9)
      continue;
    found = true;
    EXPECT_EQ(solution.joints_q[3], 0.5);
    EXPECT_NEAR(solution.joints_q[5], 0.7, 1e-12);
  }
  EXPECT_TRUE(found);
}

TEST(AnyArm, ReturnsTheTurnNextToTheHint) {
  const Kinematics k = arm("stanford");
  const Joints q{0.8, 0.6, 0.5, 0.3, 0.4, 0.9};
  Joints hint = q;
  hint[0] += 4 * kPi;
  hint[5] -= 2 * kPi + 1.0;
  const auto number = k.solution_of(q);
  ASSERT_TRUE(number.has_value());
  const IkSolution solution = k.inverse(k.forward(q), *number, hint);
  EXPECT_NEAR(solution.joints_q[0], q[0] + 4 * kPi, 1e-12);
  EXPECT_NEAR(solution.joints_q[5], q[5] - 2 * kPi, 1e-12);
}

TEST(AnyArm, RefusesWhatIsNotFinite) {
  for (const char* name :
       {"al5d", "al5d_wr", "scara_gx4", "cartesian_pppr", "cylindrical_rppr", "stanford"}) {
    const Kinematics k = arm(name);
    const Pose good = k.forward({});
    Pose bad = good;
    bad.position_m[1] = kNaN;
    EXPECT_EQ(k.inverse(bad, 0, {}).status, IkStatus::kNotFinite) << name;
    bad = good;
    bad.orientation.z = std::numeric_limits<double>::infinity();
    EXPECT_EQ(k.inverse(bad, 0, {}).status, IkStatus::kNotFinite) << name;
    bad = good;
    bad.orientation = {0.0, 0.0, 0.0, 0.0};
    EXPECT_EQ(k.inverse(bad, 0, {}).status, IkStatus::kNotFinite) << name;
    Joints hint{};
    hint[k.joint_count() - 1] = kNaN;
    EXPECT_EQ(k.inverse(good, 0, hint).status, IkStatus::kNotFinite) << name;
    EXPECT_EQ(k.inverse(good, k.solution_count(), {}).status, IkStatus::kNoSolution) << name;
  }
}

TEST(AnyArm, TakesAnotherToolAndAnotherPlaceAtRunTime) {
  const Pose base{{0.3, -0.2, 0.7}, about({0.6, 0.0, 0.8}, 1.1)};
  const Pose tool{{0.02, 0.03, 0.05}, about({0.0, 0.6, 0.8}, 0.7)};
  for (const char* name : {"al5d", "al5d_wr", "so101", "scara_gx4", "cartesian_pppr", "cartesian_ppp",
                           "cylindrical_rpp", "cylindrical_rppr", "polar_rrp", "stanford", "xarm6"}) {
    DhTable table = arm_vectors(name).table;
    Kinematics k = Kinematics::recognise(joint_chain(table));
    k.set_frames(base, tool);
    table.base_T_0 = base;
    table.n_T_tool = tool;
    Joints q{0.4, 0.5, 0.3, 0.2, 0.6, 0.1};
    for (std::size_t i = table.count; i < kMaxJoints; ++i) q[i] = 0.0;
    EXPECT_LT(apart(k.forward(q), forward(table, q)), 1e-12) << name;
    if (k.solution_count() == 0) continue;
    const auto number = k.solution_of(q);
    ASSERT_TRUE(number.has_value()) << name;
    EXPECT_LT(apart(k.forward(k.inverse(k.forward(q), *number, q).joints_q), k.forward(q)), 1e-12) << name;
  }
}

TEST(AnyArm, IsOtherWhereNoFamilyFits) {
  const Kinematics k = arm("xarm6");
  EXPECT_STREQ(k.family(), OtherArm::kName);
  EXPECT_EQ(k.solution_count(), 0u);
  EXPECT_EQ(k.inverse(k.forward({}), 0, {}).status, IkStatus::kNoSolution);
  EXPECT_FALSE(k.solution_of({}).has_value());
  // The axes of a family, but crooked by a tenth of a degree.
  DhTable table = arm_vectors("al5d").table;
  table.rows[1].alpha_rad += 0.0017;
  EXPECT_STREQ(Kinematics::recognise(joint_chain(table)).family(), OtherArm::kName);
  EXPECT_STREQ(Kinematics{}.family(), OtherArm::kName);
}

TEST(DhTables, OfBothConventionsAreTheSameChains) {
  // The standard table's rows, cut after the joint instead of before it.
  const DhTable standard = arm_vectors("al5d_wr").table;
  DhTable modified = standard;
  modified.convention = DhConvention::kModified;
  for (std::size_t i = 0; i < standard.count; ++i) {
    modified.rows[i].a_m = i == 0 ? 0.0 : standard.rows[i - 1].a_m;
    modified.rows[i].alpha_rad = i == 0 ? 0.0 : standard.rows[i - 1].alpha_rad;
  }
  const DhRow& last = standard.rows[standard.count - 1];
  modified.n_T_tool = Pose{{last.a_m, 0.0, 0.0}, about({1.0, 0.0, 0.0}, last.alpha_rad)} * standard.n_T_tool;
  const Joints q{0.4, 0.5, -0.3, 0.2, 0.6};
  EXPECT_LT(apart(forward(modified, q), forward(standard, q)), 1e-14);
  EXPECT_LT(apart(forward(joint_chain(modified), q), forward(standard, q)), 1e-14);
  EXPECT_STREQ(Kinematics::recognise(joint_chain(modified)).family(), PlanarArm::kName);
}

}  // namespace
}  // namespace corbot::arm_kinematics_test
