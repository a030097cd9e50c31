// SPDX-License-Identifier: Apache-2.0
// The paper's arm: Table II, eqs. (2) to (10), and what they are worth as printed.
#include <gtest/gtest.h>

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <iostream>
#include <limits>
#include <random>

#include "corbot/kinematics/tool_pose.h"
#include "inverse_at_pitch.h"
#include "paper_equations.h"
#include "support/cases.h"

namespace corbot::paper_arm_test {
namespace {

constexpr double kPi = std::numbers::pi;
constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kInf = std::numeric_limits<double>::infinity();
constexpr double deg(double degrees) { return degrees * kPi / 180.0; }

/// Which way the base faces, and the sign of theta2.
constexpr std::uint32_t kForwardPositive = 0, kForwardNegative = 1, kBackwardPositive = 2;

constexpr paper::Arm kLynx5{0.067, 0.120, 0.120, 0.100, {0.0, deg(10), 0.0, deg(-45)}};
constexpr paper::Arm kAl5d{0.06731, 0.14605, 0.187325, 0.100, {0.0, deg(10), 0.0, deg(-45)}};

Kinematics of(const paper::Arm& lengths) {
  return Kinematics::recognise(joint_chain(config::four_axis_table(lengths)));
}
const Kinematics& lynx5() {
  static const Kinematics arm = of(kLynx5);
  return arm;
}
const Kinematics& al5d() {
  static const Kinematics arm = of(kAl5d);
  return arm;
}

/// One D-H matrix; `printed` gives the paper's eq. (2) with its erratum in column 4.
Eigen::Matrix4d denavit_hartenberg(double theta, double d, double a, double alpha, bool printed) {
  const double ct = std::cos(theta), st = std::sin(theta), ca = std::cos(alpha), sa = std::sin(alpha);
  Eigen::Matrix4d m;
  m << ct, -ca * st, sa * st, a * (printed ? st : ct),  //
      st, ca * ct, -sa * ct, a * (printed ? ct : st),   //
      0, sa, ca, d,                                     //
      0, 0, 0, 1;
  return m;
}

/// Product of the four matrices of Table II.
Eigen::Matrix4d table_two(const paper::Arm& g, const Joints& q, bool printed) {
  const std::array<double, 4> d{g.l0_m, 0.0, 0.0, 0.0}, a{0.0, g.l1_m, g.l2_m, g.l3_m};
  const std::array<double, 4> alpha{kPi / 2, kPi, kPi, 0.0};
  Eigen::Matrix4d product = Eigen::Matrix4d::Identity();
  for (std::size_t i = 0; i < 4; ++i) {
    product *= denavit_hartenberg(q[i] + g.offset_rad[i], d[i], a[i], alpha[i], printed);
  }
  return product;
}

double distance(const std::array<double, 3>& a, const std::array<double, 3>& b) {
  return std::hypot(a[0] - b[0], a[1] - b[1], a[2] - b[2]);
}

TEST(Forward, EqualsTheProductOfTheMatrices) {
  constexpr std::uint64_t kSeed = 20240101;
  std::cout << "seed " << kSeed << "\n";
  std::mt19937_64 random(kSeed);
  std::uniform_real_distribution<double> angle(-kPi, kPi);
  for (const paper::Arm& lengths : {kLynx5, kAl5d, paper::Arm{0.1, 0.3, 0.2, 0.15, {0.3, -0.4, 0.5, 0.6}}}) {
    const Kinematics arm = of(lengths);
    for (int i = 0, poses = test::cases(100'000); i < poses; ++i) {
      const Joints q{angle(random), angle(random), angle(random), angle(random), 0, 0};
      const ToolPose pose = tool_pose(arm, q);
      const Eigen::Matrix4d m = table_two(lengths, q, false);
      for (int k = 0; k < 3; ++k) ASSERT_NEAR(pose.position_m[static_cast<std::size_t>(k)], m(k, 3), 1e-12);
      // x of the hand frame points along the hand: yaw and pitch, upward positive.
      ASSERT_NEAR(m(0, 0), std::cos(pose.pitch_rad) * std::cos(pose.yaw_rad), 1e-12);
      ASSERT_NEAR(m(1, 0), std::cos(pose.pitch_rad) * std::sin(pose.yaw_rad), 1e-12);
      ASSERT_NEAR(m(2, 0), std::sin(pose.pitch_rad), 1e-12);
    }
  }
}

TEST(Forward, ThePrintedMatrixDoesNotGiveThePapersOwnEquations) {
  const Joints q{deg(33), deg(20), deg(40), deg(15), 0, 0};
  const ToolPose pose = tool_pose(lynx5(), q);
  const Eigen::Matrix4d printed = table_two(kLynx5, q, true);
  EXPECT_GT(distance(pose.position_m, {printed(0, 3), printed(1, 3), printed(2, 3)}), 0.01);
}

TEST(Forward, ReadyIsTheStretchedArmWithTheHandBelowTheHorizontal) {
  const ToolPose pose = tool_pose(lynx5(), {});
  EXPECT_NEAR(pose.pitch_rad, deg(-35), 1e-15);
  EXPECT_NEAR(pose.position_m[0], 0.24 * std::cos(deg(10)) + 0.1 * std::cos(deg(35)), 1e-15);
  EXPECT_EQ(pose.position_m[1], 0.0);
}

TEST(Inverse, ComesBackOnEverySolutionWithItsSignAndFacing) {
  const std::array<double, 3> p{0.05, 0.03, 0.22};
  for (std::uint32_t i = 0; i < lynx5().solution_count(); ++i) {
    const IkSolution ik = test::inverse_at_pitch(lynx5(), p, deg(20), i, {});
    ASSERT_EQ(ik.status, IkStatus::kOk) << i;
    EXPECT_EQ(lynx5().solution_of(ik.joints_q), i);
    EXPECT_LT(distance(tool_pose(lynx5(), ik.joints_q).position_m, p), 1e-15);
    EXPECT_EQ(ik.joints_q[2] > 0.0, !paper::is_negative(i));
    EXPECT_NEAR(std::abs(ik.joints_q[0] - std::atan2(p[1], p[0])), paper::is_backward(i) ? kPi : 0.0, 1e-15);
  }
}

TEST(Inverse, PositiveIsTheUpperElbowOnlyInFrontOfTheShoulder) {
  // Height of the elbow above the line shoulder–wrist, by the sign of the cross product.
  const auto elbow_is_up = [](const std::array<double, 3>& p, double pitch, std::uint32_t number) {
    const IkSolution ik = test::inverse_at_pitch(lynx5(), p, pitch, number, {});
    EXPECT_EQ(ik.status, IkStatus::kOk);
    const double wrist_u = std::hypot(p[0], p[1]) - 0.1 * std::cos(pitch);
    const double wrist_h = p[2] - 0.067 - 0.1 * std::sin(pitch);
    const double a = ik.joints_q[1] + deg(10);
    return std::sin(a) * 0.12 > wrist_h / wrist_u * std::cos(a) * 0.12;
  };
  EXPECT_TRUE(elbow_is_up({0.25, 0, 0.1}, 0.0, kForwardPositive));
  EXPECT_FALSE(elbow_is_up({0.25, 0, 0.1}, 0.0, kForwardNegative));
  EXPECT_FALSE(elbow_is_up({0.02, 0, 0.1}, 0.0, kForwardPositive));  // wrist behind the shoulder
}

TEST(Inverse, ThePrintedEquationsDoNotInvert) {
  const double l0 = 0.067, l1 = 0.12, l2 = 0.12, l3 = 0.1;
  const std::array<double, 3> p{0.22, 0.05, 0.1};
  const double rho = std::hypot(p[0], p[1]);
  const double w = std::sqrt((p[2] - l0) * (p[2] - l0) + rho * rho + l3 * l3 - 2 * l3 * rho);
  const double t1 = std::asin((p[2] - l0) / w) + std::acos((w * w + l1 * l1 - l2 * l2) / (2 * l1 * w));
  const double t2 = std::acos(-(w * w - l1 * l1 - l2 * l2) / (2 * l1 * l2));
  const Joints printed{std::atan(p[1] / p[0]), t1, t2, t2 - t1 + deg(35), 0, 0};
  EXPECT_NEAR(distance(tool_pose(lynx5(), printed).position_m, p), 0.120, 0.001);
}

TEST(Inverse, KeepsTheHintOnTheBaseAxisOnly) {
  const IkSolution on_axis =
      test::inverse_at_pitch(lynx5(), {0.0, 0.0, 0.3}, deg(90), kForwardPositive, {0.7});
  ASSERT_EQ(on_axis.status, IkStatus::kOk);
  EXPECT_EQ(on_axis.joints_q[0], 0.7);
  EXPECT_EQ(test::inverse_at_pitch(lynx5(), {5e-14, 0.0, 0.3}, deg(90), kBackwardPositive, {0.7}).joints_q[0],
            0.7);
  EXPECT_EQ(test::inverse_at_pitch(lynx5(), {2e-13, 0.0, 0.3}, deg(90), kForwardPositive, {0.7}).joints_q[0],
            0.0);
}

TEST(Inverse, TheBorderIsReachableAndAHairBeyondItIsNot) {
  const double reach = 0.24 + 0.1;
  for (const double miss : {0.0, 5e-14, -5e-14}) {
    const IkSolution ik =
        test::inverse_at_pitch(lynx5(), {reach + miss, 0.0, 0.067}, 0.0, kForwardPositive, {0.0});
    ASSERT_EQ(ik.status, IkStatus::kOk) << miss;
    EXPECT_LT(distance(tool_pose(lynx5(), ik.joints_q).position_m, {reach + miss, 0.0, 0.067}), 1e-12);
  }
  EXPECT_EQ(test::inverse_at_pitch(lynx5(), {reach + 3e-12, 0, 0.067}, 0.0, kForwardPositive, {0}).status,
            IkStatus::kTooFar);
  const double least = 0.187325 - 0.14605;
  const auto at = [](double u) {
    return test::inverse_at_pitch(al5d(), {0.1 + u, 0.0, 0.06731}, 0.0, kForwardPositive, {0.0}).status;
  };
  EXPECT_EQ(at(least), IkStatus::kOk);
  EXPECT_EQ(at(least + 1e-12), IkStatus::kOk);
  EXPECT_EQ(at(least - 3e-12), IkStatus::kTooClose);
}

TEST(Inverse, AtPZeroEqualLinksFoldWhereTheUpperArmIsAndUnequalOnesCannot) {
  const std::array<double, 3> shoulder{0.1, 0.0, 0.067};
  for (const std::uint32_t number : {kForwardPositive, kForwardNegative}) {
    const IkSolution folded = test::inverse_at_pitch(lynx5(), shoulder, 0.0, number, {0.0, 0.7});
    ASSERT_EQ(folded.status, IkStatus::kOk);
    EXPECT_NEAR(folded.joints_q[1], 0.7, 1e-15);
    EXPECT_NEAR(folded.joints_q[2], number == kForwardPositive ? kPi : -kPi, 1e-15);
    EXPECT_LT(distance(tool_pose(lynx5(), folded.joints_q).position_m, shoulder), 1e-15);
  }
  const IkSolution unequal =
      test::inverse_at_pitch(al5d(), {0.1, 0.0, 0.06731}, 0.0, kForwardPositive, {0.0});
  EXPECT_EQ(unequal.status, IkStatus::kTooClose);
  EXPECT_NEAR(unequal.limit_m, 0.041275, 1e-15);
  EXPECT_NEAR(unequal.distance_m, 0.0, 1e-15);
}

TEST(Inverse, SaysWhatIsWrongAndNeverAnswersNan) {
  const std::array<double, 3> good{0.2, 0.0, 0.1};
  for (const double bad : {kNan, kInf, -kInf}) {
    for (std::size_t i = 0; i < 3; ++i) {
      auto p = good;
      p[i] = bad;
      EXPECT_EQ(test::inverse_at_pitch(lynx5(), p, 0, kForwardPositive, {0}).status, IkStatus::kNotFinite);
    }
    EXPECT_EQ(test::inverse_at_pitch(lynx5(), good, bad, kForwardPositive, {0}).status, IkStatus::kNotFinite);
    EXPECT_EQ(test::inverse_at_pitch(lynx5(), good, 0, kForwardPositive, {bad}).status, IkStatus::kNotFinite);
  }
  const IkSolution far = test::inverse_at_pitch(lynx5(), {1e100, 1e100, -1e100}, 0, kForwardPositive, {0});
  EXPECT_EQ(far.status, IkStatus::kTooFar);
  EXPECT_EQ(far.joints_q, Joints{});
  EXPECT_NEAR(far.limit_m, 0.24, 1e-15);
}

/// The tool's x axis is in the arm's plane or not, and the base is upright, tilted or hangs. In every eighth
/// case the hand of a hanging arm points straight up or down.
TEST(ToolPose, IsTheOrientationOfEveryToolOnEveryBase) {
  std::mt19937_64 random(test::seed());
  const auto angle = [&] { return std::uniform_real_distribution<double>(-kPi, kPi)(random); };
  const Vector3 x{1.0, 0.0, 0.0}, y{0.0, 1.0, 0.0}, z{0.0, 0.0, 1.0};
  const auto any = [&] { return about(z, angle()) * about(y, angle()) * about(x, angle()); };
  for (int i = 0; i < 4000; ++i) {
    const bool is_steep = i % 8 == 7;
    Quaternion tool = i % 4 == 1 ? any() : about(z, is_steep ? 0.0 : angle()) * about(x, angle());
    if (i % 2 == 0) tool = {-tool.w, -tool.x, -tool.y, -tool.z};
    const Quaternion base = is_steep ? about(x, kPi) : i % 4 == 3 ? any() : about(z, angle());
    Kinematics arm = lynx5();
    arm.set_frames({{0.1, 0.2, 0.3}, base}, {{0.01, 0.02, 0.03}, tool});
    Joints q{angle(), angle(), angle(), angle()};
    if (is_steep) q[3] = deg(i % 16 == 7 ? 125 : -55) - q[1] + q[2];
    const ToolPose pose = tool_pose(arm, q);
    const Quaternion found = about(z, pose.yaw_rad) * about(y, -pose.pitch_rad) * about(x, pose.roll_rad);
    ASSERT_LT(angle_between(arm.forward(q).orientation, found), 1e-7) << "case " << i;
  }
}

TEST(WrapAngle, IsInTheHalfOpenCircle) {
  EXPECT_EQ(wrap_angle(kPi), kPi);
  EXPECT_EQ(wrap_angle(-kPi), kPi);
  EXPECT_NEAR(wrap_angle(deg(190)), deg(-170), 1e-15);
  EXPECT_NEAR(wrap_angle(deg(-3600 - 20)), deg(-20), 1e-13);
  EXPECT_LE(std::abs(wrap_angle(1e300)), kPi);
}

}  // namespace
}  // namespace corbot::paper_arm_test
