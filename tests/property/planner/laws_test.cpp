// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <algorithm>
#include <random>

#include "corbot/motion/law_evaluation.h"
#include "planner/time_law_planner.h"
#include "support/cases.h"

namespace corbot::property_laws_test {
namespace {

double log_uniform(std::mt19937_64& random, double low_exponent, double high_exponent) {
  return std::pow(10.0, std::uniform_real_distribution<double>(low_exponent, high_exponent)(random));
}

/// Limits respected and continuous, sampled densely; exact at the end.
void check_law(const TimeLaw& law, const LawLimits& limits) {
  ASSERT_TRUE(is_well_formed(law));
  const double duration_s = law.duration_s();
  constexpr double kSlack = 1.0 + 1e-12;
  const LawPeaks peak = peaks(law);
  ASSERT_LE(peak.velocity, limits.velocity * kSlack);
  ASSERT_LE(peak.acceleration, limits.acceleration * kSlack);
  ASSERT_LE(peak.jerk, limits.jerk * kSlack);
  constexpr int kSteps = 64;
  const double step_s = duration_s / kSteps;
  LawState last = evaluate(law, 0.0);
  for (int i = 1; i <= kSteps; ++i) {
    const LawState now = evaluate(law, i * step_s);
    ASSERT_LE(std::abs(now.velocity), limits.velocity * kSlack);
    ASSERT_LE(std::abs(now.acceleration), limits.acceleration * kSlack);
    ASSERT_LE(std::abs(now.jerk), limits.jerk * kSlack);
    // The limit of the next derivative, times the step, bounds every jump.
    const double rounding = 1e-12;
    ASSERT_LE(std::abs(now.position - last.position),
              limits.velocity * step_s * kSlack + rounding * std::abs(law.distance));
    ASSERT_LE(std::abs(now.velocity - last.velocity),
              limits.acceleration * step_s * kSlack + rounding * peak.velocity);
    ASSERT_LE(std::abs(now.acceleration - last.acceleration),
              limits.jerk * step_s * kSlack + rounding * peak.acceleration);
    // Position is the integral of the velocity, to second order.
    const double mean = 0.5 * (now.velocity + last.velocity);
    ASSERT_NEAR(now.position - last.position, mean * step_s,
                peak.jerk * step_s * step_s * step_s + rounding * std::abs(law.distance));
    last = now;
  }
  ASSERT_EQ(evaluate(law, duration_s).position, law.distance);
  const double just_before = evaluate(law, std::nextafter(duration_s, 0.0)).position;
  ASSERT_NEAR(just_before, law.distance, 1e-15 * std::abs(law.distance));
}

TEST(Laws, AHundredThousandKeepTheirLimitsAndAreShort) {
  std::mt19937_64 random(test::seed());
  std::array<int, 4> met{};
  for (int i = 0; i < 100'000; ++i) {
    const LawLimits limits{log_uniform(random, -3, 3), log_uniform(random, -3, 4),
                           log_uniform(random, -2, 5)};
    const double size = i % 10 == 0 ? log_uniform(random, -300, -3) : log_uniform(random, -6, 3);
    const double distance = i % 2 == 0 ? size : -size;
    const TimeLaw law = plan_law(distance, limits);
    ASSERT_NO_FATAL_FAILURE(check_law(law, limits)) << "case " << i << " distance " << distance;
    ++met[(law.t_cruise_s > 0.0 ? 1u : 0u) + (law.t_acc_s > 0.0 ? 2u : 0u)];

    // Optimal: where a segment is left out, the limit it stands for cannot be used;
    // else that limit is reached.
    const LawPeaks peak = peaks(law);
    const double tightest = std::max(
        {peak.velocity / limits.velocity, peak.acceleration / limits.acceleration, peak.jerk / limits.jerk});
    ASSERT_NEAR(peak.jerk / limits.jerk, 1.0, 1e-9);
    ASSERT_NEAR(tightest, 1.0, 1e-9);
    if (law.t_cruise_s > 1e-9 * law.duration_s()) {
      ASSERT_NEAR(peak.velocity / limits.velocity, 1.0, 1e-9);
    }
    if (law.t_acc_s > 1e-9 * law.duration_s()) {
      ASSERT_NEAR(peak.acceleration / limits.acceleration, 1.0, 1e-9);
    }

    const double factor = 1.0 + log_uniform(random, -6, 3);
    const TimeLaw slow = stretch(law, law.duration_s() * factor);
    ASSERT_NEAR(slow.duration_s(), law.duration_s() * factor, 4e-16 * slow.duration_s());
    ASSERT_NEAR(peaks(slow).velocity, peak.velocity / factor, 1e-9 * peak.velocity);
    ASSERT_NO_FATAL_FAILURE(check_law(slow, limits)) << "case " << i << " stretched";
  }
  for (const int count : met) EXPECT_GT(count, 500) << "one of the four cases is hardly tested";
}

TEST(Laws, TinyAndZeroDistances) {
  const LawLimits limits{2.6, 14.0, 140.0};
  for (const double distance : {5e-324, 1e-320, 1e-300, -1e-300, 1e-100, 1e-15, -1e-15, 1e-9}) {
    const TimeLaw law = plan_law(distance, limits);
    ASSERT_TRUE(is_well_formed(law)) << distance;
    ASSERT_EQ(evaluate(law, law.duration_s()).position, distance);
    if (std::abs(distance) > 1e-305) {
      ASSERT_NO_FATAL_FAILURE(check_law(law, limits)) << distance;
    }
    const TimeLaw slow = stretch(law, 3600.0);
    ASSERT_TRUE(is_well_formed(slow)) << distance;
    ASSERT_NEAR(slow.duration_s(), 3600.0, 1e-12);
  }
  const TimeLaw none = plan_law(0.0, limits);
  EXPECT_EQ(none.duration_s(), 0.0);
  EXPECT_TRUE(is_well_formed(none));
  EXPECT_EQ(stretch(none, 3.0).duration_s(), 3.0);
  EXPECT_EQ(evaluate(stretch(none, 3.0), 1.5).position, 0.0);
}

}  // namespace
}  // namespace corbot::property_laws_test
