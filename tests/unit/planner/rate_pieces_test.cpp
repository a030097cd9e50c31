// SPDX-License-Identifier: Apache-2.0
// The rate along a path in pieces of constant jerk.
#include "planner/rate/pieces.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <vector>

#include "corbot/motion/law_evaluation.h"

namespace corbot::unit_rate_pieces_test {
namespace {

using rate::RateLaw;
using rate::RateState;

/// Any three steps or more.
RateLaw random_law(std::size_t steps, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> part(0.5, 1.5);
  std::vector<double> lambda_s{0.0}, steps_s;
  for (std::size_t k = 0; k < steps; ++k) {
    lambda_s.push_back(lambda_s.back() + 0.02 * part(random));
    steps_s.push_back(0.01 * part(random));
  }
  return {lambda_s, steps_s};
}

TEST(RatePieces, AreALawWhoseJerkJumpsAtTheNodes) {
  const TimeLaw law{0.7, 0.05, 0.03, 0.4};
  const std::vector<double> steps_s{0.05, 0.03, 0.05, 0.4, 0.05, 0.03, 0.05};
  std::vector<double> lambda_s{0.0};
  double t_s = 0.0;
  for (const double step_s : steps_s) lambda_s.push_back(evaluate(law, t_s += step_s).position);
  lambda_s[1] = lambda_s[6] = -1.0;  // not looked at
  const RateLaw pieces(lambda_s, steps_s);
  EXPECT_NEAR(pieces.duration_s(), law.duration_s(), 1e-15);
  for (int k = 0; k < 1000; ++k) {
    const double at_s = law.duration_s() * (k + 0.37) / 1000.0;
    const LawState wanted = evaluate(law, at_s);
    const RateState is = pieces.at(at_s);
    ASSERT_NEAR(is.lambda_s, wanted.position, 1e-13);
    ASSERT_NEAR(is.v, wanted.velocity, 1e-12);
    ASSERT_NEAR(is.a, wanted.acceleration, 1e-10);
    ASSERT_NEAR(is.j, wanted.jerk, 1e-8);
  }
}

TEST(RatePieces, HaveTwoContinuousDerivativesAndRestAtBothEnds) {
  for (const std::size_t steps : {3, 4, 5, 64}) {
    const RateLaw law = random_law(steps, steps);
    ASSERT_EQ(law.pieces().size(), steps);
    for (std::size_t k = 0; k < steps; ++k) {
      const RateState before = k == 0 ? RateState{} : law.at(k - 1, law.end_s(k - 1));
      const RateState after = law.at(k, law.pieces()[k].begin_s);
      EXPECT_NEAR(after.lambda_s, before.lambda_s, 1e-12) << k;
      EXPECT_NEAR(after.v, before.v, 1e-10) << k;
      EXPECT_NEAR(after.a, before.a, 1e-8) << k;
    }
    const RateState end = law.at(law.duration_s());
    EXPECT_EQ(end.lambda_s, law.length_s());
    EXPECT_EQ(end.v, 0.0);
    EXPECT_EQ(end.a, 0.0);
    EXPECT_EQ(law.at(1e9).lambda_s, law.length_s());
    EXPECT_EQ(law.at(-1.0).lambda_s, 0.0);
  }
}

TEST(RatePieces, AreStretchedByPowersOfTheFactor) {
  const RateLaw law = random_law(16, 1);
  RateLaw slow = law;
  slow.stretch(1.5);
  EXPECT_DOUBLE_EQ(slow.duration_s(), 1.5 * law.duration_s());
  EXPECT_EQ(slow.at(slow.duration_s()).lambda_s, law.length_s());
  for (int k = 0; k < 200; ++k) {
    const double t_s = law.duration_s() * (k + 0.5) / 200.0;
    const RateState a = law.at(t_s), b = slow.at(1.5 * t_s);
    ASSERT_NEAR(b.lambda_s, a.lambda_s, 1e-12);
    ASSERT_NEAR(b.v * 1.5, a.v, 1e-10);
    ASSERT_NEAR(b.a * 1.5 * 1.5, a.a, 1e-8);
    ASSERT_NEAR(b.j * 1.5 * 1.5 * 1.5, a.j, 1e-5);
  }
}

}  // namespace
}  // namespace corbot::unit_rate_pieces_test
