// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>

#include "corbot/kinematics/angles.h"
#include "corbot/kinematics/sub_problems.h"

namespace corbot::sub_problems_test {
namespace {

constexpr double kPi = std::numbers::pi;

void expect_turned(const Turn& t, double x, double y, double b, double tolerance_m = 1e-15) {
  ASSERT_EQ(t.reach, Reach::kOk);
  const double c = std::cos(t.angle_rad), s = std::sin(t.angle_rad);
  EXPECT_NEAR(c * t.radius_m - s * b, x, tolerance_m);
  EXPECT_NEAR(s * t.radius_m + c * b, y, tolerance_m);
  EXPECT_NEAR(t.cosine, c, 1e-12);
  EXPECT_NEAR(t.sine, s, 1e-12);
}

TEST(TurnAboutAnAxis, HasTheArmInFrontAndBehind) {
  for (const double b : {0.0, 0.05, -0.05}) {
    const Turn front = turn(0.1, -0.2, b, false);
    const Turn behind = turn(0.1, -0.2, b, true);
    expect_turned(front, 0.1, -0.2, b);
    expect_turned(behind, 0.1, -0.2, b);
    EXPECT_GT(front.radius_m, 0.0);
    EXPECT_LT(behind.radius_m, 0.0);
  }
}

TEST(TurnAboutAnAxis, RefusesWhatIsNearerThanTheOffset) {
  const Turn t = turn(0.03, 0.04, 0.0501, false);
  EXPECT_EQ(t.reach, Reach::kTooClose);
  EXPECT_NEAR(t.distance_m, 0.05, 1e-15);
}

TEST(TurnAboutAnAxis, HasOneRootAtTheOffset) {
  for (const double rho : {0.05, 0.05 - 9e-13}) {  // on the border, and within its tolerance
    const Turn front = turn(rho, 0.0, 0.05, false);
    const Turn behind = turn(rho, 0.0, 0.05, true);
    expect_turned(front, rho, 0.0, 0.05, 1e-12);
    EXPECT_NEAR(wrap_angle(front.angle_rad - behind.angle_rad), 0.0, 1e-15);
    EXPECT_EQ(std::abs(front.radius_m), 0.0);
    EXPECT_GT(front.slack_m, 1e-9) << "a rounding of the point is a large part of the radius here";
  }
  EXPECT_EQ(turn(0.05 - 2e-12, 0.0, 0.05, false).reach, Reach::kTooClose);
}

TEST(TurnAboutAnAxis, IsFreeOnTheAxis) {
  for (const bool behind : {false, true}) {
    const Turn t = turn(5e-14, -5e-14, 0.0, behind);
    EXPECT_EQ(t.reach, Reach::kOk);
    EXPECT_TRUE(t.free);
    EXPECT_EQ(t.radius_m, 0.0);
  }
  EXPECT_FALSE(turn(2e-13, 0.0, 0.0, false).free);
}

TEST(TurnAboutAnAxis, TakesAHeadingThatFits) {
  // 1e-9 m from the axis, where the point's own angle is wrong by 1e-7 rad.
  const double heading = 0.7, ahead = 1e-9;
  const double x = ahead * std::cos(heading) + 1e-16, y = ahead * std::sin(heading) - 1e-16;
  Turn t = turn(x, y, 0.0, false);
  EXPECT_GT(std::abs(t.angle_rad - heading), 1e-8);
  EXPECT_FALSE(take_heading(t, x, y, 0.0, true, heading)) << "that is in front";
  EXPECT_FALSE(take_heading(t, x, y, 0.0, false, heading + 0.01)) << "that is beside it";
  ASSERT_TRUE(take_heading(t, x, y, 0.0, false, heading));
  EXPECT_EQ(t.angle_rad, heading);
  EXPECT_NEAR(t.radius_m, ahead, 1e-15);
}

void expect_bent(const TwoLinks& t, double u, double v, double l1, double l2, double tolerance_m = 2e-15) {
  ASSERT_EQ(t.reach, Reach::kOk);
  EXPECT_NEAR(l1 * std::cos(t.first_rad) + l2 * std::cos(t.first_rad + t.second_rad), u, tolerance_m);
  EXPECT_NEAR(l1 * std::sin(t.first_rad) + l2 * std::sin(t.first_rad + t.second_rad), v, tolerance_m);
}

TEST(TwoLinksInAPlane, BendBothWays) {
  for (const auto& [l1, l2] : {std::pair{0.3, 0.2}, std::pair{0.2, 0.3}, std::pair{0.25, 0.25}}) {
    const TwoLinks up = two_r(-0.1, 0.25, l1, l2, false);
    const TwoLinks down = two_r(-0.1, 0.25, l1, l2, true);
    expect_bent(up, -0.1, 0.25, l1, l2);
    expect_bent(down, -0.1, 0.25, l1, l2);
    EXPECT_GT(up.second_rad, 0.0);
    EXPECT_NEAR(up.second_rad, -down.second_rad, 1e-15);
  }
}

TEST(TwoLinksInAPlane, AreOneWhenStretched) {
  const double u = 0.3, v = 0.4;
  for (const double l2 : {0.3, 0.3 - 9e-13}) {  // a miss within the tolerance
    const TwoLinks up = two_r(u, v, 0.2, l2, false), down = two_r(u, v, 0.2, l2, true);
    expect_bent(up, u, v, 0.2, l2, 1e-12);
    EXPECT_NEAR(up.second_rad, 0.0, 1e-7);
    EXPECT_NEAR(up.first_rad, down.first_rad, 1e-7);
  }
  const TwoLinks far = two_r(u, v, 0.2, 0.3 - 2e-12, false);
  EXPECT_EQ(far.reach, Reach::kTooFar);
  EXPECT_NEAR(far.distance_m, 0.5, 1e-15);
}

TEST(TwoLinksInAPlane, AreOneWhenFolded) {
  const TwoLinks up = two_r(0.0, -0.1, 0.2, 0.3, false), down = two_r(0.0, -0.1, 0.2, 0.3, true);
  expect_bent(up, 0.0, -0.1, 0.2, 0.3, 1e-12);
  expect_bent(down, 0.0, -0.1, 0.2, 0.3, 1e-12);
  EXPECT_NEAR(wrap_angle(up.second_rad - down.second_rad), 0.0, 1e-7);
  EXPECT_EQ(two_r(0.0, 0.0999, 0.2, 0.3, false).reach, Reach::kTooClose);
}

TEST(TwoLinksInAPlane, AreFreeWhenFoldedOntoTheirBase) {
  const TwoLinks t = two_r(5e-14, 0.0, 0.25, 0.25, false);
  EXPECT_EQ(t.reach, Reach::kOk);
  EXPECT_TRUE(t.free);
  EXPECT_NEAR(t.second_rad, kPi, 1e-12);
}

TEST(TwoLinksInAPlane, AreNotRefusedForWhatIsLeftOpen) {
  const double u = std::sqrt(0.25 - 0.01) + 4e-9, v = 0.1;
  EXPECT_EQ(two_r(u, v, 0.2, 0.3, false).reach, Reach::kTooFar);
  EXPECT_EQ(two_r(u, v, 0.2, 0.3, false, 3e-9).reach, Reach::kTooFar);
  EXPECT_EQ(two_r(u, v, 0.2, 0.3, false, 5e-9).reach, Reach::kOk);
}

Quaternion product(double a, double b, double c) {
  return about({0.0, 0.0, 1.0}, a) * about({0.0, 1.0, 0.0}, b) * about({0.0, 0.0, 1.0}, c);
}
double off(const Quaternion& q, const Zyz& t) {
  return angle_between(q, product(t.first_rad, t.middle_rad, t.last_rad));
}

TEST(ZyzAngles, FindBothSolutions) {
  const Quaternion q = product(0.4, -1.1, 2.2);
  const Zyz plain = zyz(q, false, 0.0), flipped = zyz(q, true, 0.0);
  EXPECT_LT(off(q, plain), 1e-15);
  EXPECT_LT(off(q, flipped), 1e-15);
  EXPECT_NEAR(plain.middle_rad, 1.1, 1e-15);
  EXPECT_NEAR(flipped.middle_rad, -1.1, 1e-15);
  EXPECT_NEAR(wrap_angle(flipped.first_rad - 0.4), 0.0, 1e-15);
  EXPECT_NEAR(wrap_angle(flipped.last_rad - 2.2), 0.0, 1e-15);
}

TEST(ZyzAngles, KeepAllDigitsBesideTheSingularity) {
  for (const double turned : {0.0, kPi}) {
    for (int digits = 3; digits <= 16; ++digits) {
      const double bend = std::pow(10.0, -digits);
      for (const bool flipped : {false, true}) {
        const Quaternion q = product(0.4, turned + bend, 2.2);
        EXPECT_LT(off(q, zyz(q, flipped, 0.9)), bend > 1e-12 ? 1e-15 : 1e-12) << turned << " + " << bend;
      }
    }
  }
}

TEST(ZyzAngles, KeepTheHintAtTheSingularity) {
  for (const double turned : {0.0, kPi}) {
    const Quaternion q = product(0.4, turned, 2.2);
    const Zyz t = zyz(q, false, 0.9);
    EXPECT_TRUE(t.free);
    EXPECT_EQ(t.first_rad, 0.9);
    EXPECT_LT(off(q, t), 1e-15);
  }
}

TEST(Rotations, AreTheSameAsMatrices) {
  for (const auto& [x, y, z] : {Vector3{0.1, 0.2, 0.3}, Vector3{3.1, 0.1, 0.0}, Vector3{0.0, 3.1, 0.1},
                                Vector3{0.1, 0.0, 3.1}, Vector3{2.0, -2.0, 1.0}}) {
    const Quaternion q = about({1.0, 0.0, 0.0}, x) * about({0.0, 1.0, 0.0}, y) * about({0.0, 0.0, 1.0}, z);
    EXPECT_LT(angle_between(to_quaternion(to_matrix(q)), q), 1e-15);
    EXPECT_GE(to_quaternion(to_matrix(q)).w, 0.0);
    const Vector3 v{0.3, -0.2, 0.7};
    const Matrix3 r = to_matrix(q);
    EXPECT_LT(norm(rotate(q, v) - Vector3{dot(r[0], v), dot(r[1], v), dot(r[2], v)}), 1e-15);
    const Pose pose{v, q};
    EXPECT_LT(norm((pose * inverse_of(pose)).position_m), 1e-15);
  }
}

TEST(Rotations, HaveAnAngleWithoutLosingDigits) {
  for (const double angle : {1e-12, 1e-8, 0.5, kPi}) {
    const Quaternion q = about({0.0, 0.6, 0.8}, angle);
    EXPECT_NEAR(angle_between({}, q), angle, 1e-15);
    EXPECT_NEAR(angle_between({}, {-q.w, -q.x, -q.y, -q.z}), angle, 1e-15);
  }
}

TEST(NearestTurn, KeepsEveryBitWithinHalfATurn) {
  EXPECT_EQ(nearest_turn(3.0, 0.5), 3.0);
  EXPECT_NEAR(nearest_turn(-3.0, 3.0), 2 * kPi - 3.0, 1e-15);
  EXPECT_NEAR(nearest_turn(0.1, 12.5), 0.1 + 4 * kPi, 1e-14);
}

TEST(TurnWithinLimits, IsTheOneNextToTheHint) {
  EXPECT_NEAR(*turn_within(0.5, -7.0, 7.0, 0.0, -5.0), 0.5 - 2 * kPi, 1e-15);
  EXPECT_NEAR(*turn_within(0.5, -7.0, 7.0, 0.0, 1.0), 0.5, 1e-15);
  EXPECT_NEAR(*turn_within(0.5, -7.0, 7.0, 0.0, 5.0), 0.5 + 2 * kPi, 1e-15);
  EXPECT_NEAR(*turn_within(0.5, -5.0, 7.0, 0.0, -5.0), 0.5, 1e-15);
  EXPECT_NEAR(*turn_within(0.5 + 4 * kPi, -1.0, 1.0, 0.0, 9.0), 0.5, 1e-14);
  EXPECT_FALSE(turn_within(1.5, -1.0, 1.0, 0.0, 0.0).has_value());
  EXPECT_EQ(*turn_within(1.0 + 1e-9, -1.0, 1.0, 1e-7, 0.0), 1.0 + 1e-9);
  EXPECT_FALSE(turn_within(1.0 + 1e-6, -1.0, 1.0, 1e-7, 0.0).has_value());
  EXPECT_FALSE(turn_within(std::numeric_limits<double>::quiet_NaN(), -1.0, 1.0, 1e-7, 0.0).has_value());
}

}  // namespace
}  // namespace corbot::sub_problems_test
