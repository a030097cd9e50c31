// SPDX-License-Identifier: Apache-2.0
#include "corbot/kinematics/arc_tangent.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>
#include <random>

#include "corbot/kinematics/angles.h"

namespace corbot::arc_tangent_test {
namespace {

TEST(ArcTangent, IsTheCLibrarysToTheLastDigits) {
  std::mt19937_64 random(1751);
  std::uniform_real_distribution<double> unit(-1.0, 1.0), exponent(-30.0, 0.0);
  for (int k = 0; k < 1'000'000; ++k) {
    double x = unit(random), y = unit(random);
    if (k % 3 == 1) y *= std::pow(10.0, exponent(random));
    if (k % 3 == 2) x *= std::pow(10.0, exponent(random));
    const double expected = std::atan2(y, x);
    ASSERT_NEAR(arc_tangent(y, x), expected,
                5e-16 * std::fmin(1.0, std::abs(expected)) + 4.5e-16 * (std::abs(expected) > 0.5))
        << y << " " << x;
  }
}

TEST(ArcTangent, HasTheSignsAndZerosOfTheCLibrarys) {
  for (const double y : {0.0, -0.0, 1.0, -1.0, 1e-300, -1e-300, 1e300}) {
    for (const double x : {0.0, -0.0, 1.0, -1.0, 1e-300, -1e-300, 1e300}) {
      const double expected = std::atan2(y, x), got = arc_tangent(y, x);
      EXPECT_DOUBLE_EQ(got, expected) << y << " " << x;
      EXPECT_EQ(std::signbit(got), std::signbit(expected)) << y << " " << x;
    }
  }
}

TEST(ArcTangent, StaysWithinItsTableWhateverItIsGiven) {
  const double inf = std::numeric_limits<double>::infinity(), nan = std::numeric_limits<double>::quiet_NaN();
  for (const double y : {inf, -inf, nan, 0.0, 1.0}) {
    for (const double x : {inf, -inf, nan, 0.0, 1.0}) {
      const double got = arc_tangent(y, x);
      EXPECT_TRUE(std::isnan(got) || std::abs(got) <= std::numbers::pi) << y << " " << x;
    }
  }
}

TEST(NearestTurn, KeepsEveryBitNextToItsHintAndTurnsAnyNumberOfTimes) {
  std::mt19937_64 random(1751);
  std::uniform_real_distribution<double> angle(-40.0, 40.0);
  for (int k = 0; k < 100'000; ++k) {
    const double a = angle(random), hint = angle(random);
    const double got = nearest_turn(a, hint);
    ASSERT_LE(std::abs(got - hint), std::numbers::pi + 1e-14);
    ASSERT_NEAR(std::remainder(got - a, 2.0 * std::numbers::pi), 0.0, 2e-14);
    if (std::abs(a - hint) <= std::numbers::pi) {
      ASSERT_EQ(got, a);
    }
  }
}

}  // namespace
}  // namespace corbot::arc_tangent_test
