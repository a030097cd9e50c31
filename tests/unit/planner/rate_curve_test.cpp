// SPDX-License-Identifier: Apache-2.0
// Virtual time: its rate keeps both inequalities at every instant, reaches what is wanted, and does not
// depend on the cycle's period.
#include "corbot/motion/rate_curve.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <random>
#include <span>

#include "corbot/motion/rate_stop.h"

namespace corbot::unit_rate_curve_test {
namespace {

using rate::RateCurve;
using rate::RateGovernor;
using rate::RateLimit;
using rate::Shares;

constexpr std::array<RateLimit, 3> kLimits{RateLimit{3.1, 15.7, 140.0}, RateLimit{2.6, 14.0, 140.0},
                                           RateLimit{0.25, 1.0, 10.0}};
constexpr Shares kFull{1.0, 0.97, 0.95};

double until_rest_s(RateGovernor& governor, double period_s) {
  double t_s = 0.0;
  governor.seek(0.0);
  for (; !governor.is_at_rest() && t_s < 10.0; t_s += period_s) governor.advance(period_s);
  return t_s;
}

TEST(RateGovernor, StopsAlikeAtEveryPeriod) {
  const RateCurve curve(kLimits, kFull);
  for (const double from : {1.0, 0.9, 0.5, 0.01}) {
    SCOPED_TRACE(from);
    RateGovernor fine;
    fine.begin(curve, from);
    const double stop_s = until_rest_s(fine, 1e-5), rests_s = fine.time_s();
    EXPECT_GT(rests_s, 0.0);
    for (const double period_s : {2.5e-4, 1e-3, 2e-2, 1.0}) {
      RateGovernor governor;
      governor.begin(curve, from);
      EXPECT_NEAR(until_rest_s(governor, period_s), stop_s, 1.01 * period_s);
      EXPECT_NEAR(governor.time_s(), rests_s, 1e-9);
      EXPECT_EQ(governor.rate(), 0.0);
    }
  }
}

/// A motion at a hundredth of its speed comes to rest within milliseconds, through all cells of the curve.
TEST(StopAhead, IsExactlyWhereTheCyclesLeadAndSharesOutALongWay) {
  const RateCurve slow(kLimits, Shares{0.01, 1e-4, 1e-6}), full(kLimits, kFull);
  constexpr int kCycles = rate::StopSearch::kCalls;
  const auto calls_to = [&](const RateCurve& curve, double dt_s, int before) {
    RateGovernor governor;
    governor.begin(curve, 1.0);
    governor.seek(0.0);
    for (int cycle = 0; cycle < before; ++cycle) governor.advance(dt_s);
    rate::StopAhead ahead;
    ahead.begin(governor, kCycles, dt_s);
    int calls = 1;
    while (!ahead.step()) ++calls;
    for (int cycle = 0; cycle < kCycles; ++cycle) governor.advance(dt_s);
    EXPECT_TRUE(ahead.governor().is_as(governor)) << dt_s << " s, from cycle " << before;
    return calls;
  };
  for (const double dt_s : {1e-4, 1e-3, 5e-3}) {
    for (const int before : {0, 1, 7}) {
      EXPECT_LT(calls_to(slow, dt_s, before), kCycles);
      EXPECT_LT(calls_to(full, dt_s, before), kCycles);
    }
  }
  EXPECT_EQ(calls_to(full, 1e-3, 0), 1) << "nothing of the search's time is lost";
  EXPECT_GT(calls_to(slow, 1e-3, 0), 1) << "one cycle has no time for all of it";
}

TEST(RateGovernor, ReachesTheWantedRateAndStays) {
  const RateCurve curve(kLimits, kFull);
  RateGovernor governor;
  governor.begin(curve, 0.0);
  for (const double wanted : {1.0, 0.3, 0.31, 1.0, 0.0, 1e-6, 1.0}) {
    governor.seek(wanted);
    governor.advance(2.0);
    EXPECT_EQ(governor.rate(), wanted);
    EXPECT_EQ(governor.change_1_s(), 0.0);
    const double then_s = governor.time_s();
    governor.advance(0.5);
    EXPECT_NEAR(governor.time_s() - then_s, 0.5 * wanted, 1e-12);
  }
}

/// Shares of both inequalities over a step, from what is surely passed within it; z is its mean.
struct Step {
  double u0, w0, u1, w1, length_s;
};
double greatest_share(std::span<const RateLimit> limits, const Shares& most, const Step& step) {
  const double u = std::min(step.u0, step.u1), z = std::abs(step.w1 - step.w0) / step.length_s;
  const double w = step.w0 * step.w1 < 0.0 ? 0.0 : std::min(std::abs(step.w0), std::abs(step.w1));
  double share = 0.0;
  for (const RateLimit& limit : limits) {
    share = std::max(share, most.acceleration * u * u + most.speed * limit.speed / limit.acceleration * w);
    share = std::max(share, most.jerk * u * u * u +
                                3.0 * most.acceleration * limit.acceleration / limit.jerk * u * w +
                                most.speed * limit.speed / limit.jerk * z);
  }
  return share;
}

TEST(RateGovernor, KeepsBothInequalitiesAtEveryInstant) {
  std::mt19937_64 random(1751);
  const auto in = [&](double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(random);
  };
  double closest = 0.0;
  for (int i = 0; i < 300; ++i) {
    SCOPED_TRACE(i);
    std::array<RateLimit, 2> limits{};
    for (RateLimit& limit : limits) {
      const double ramp_s = in(0.02, 0.5), turn_s = ramp_s * in(0.02, 2.0);
      limit = {1.0, 1.0 / ramp_s, 1.0 / (ramp_s * turn_s)};
    }
    const Shares most = i % 2 == 0 ? kFull : Shares{in(0.0, 1.0), in(0.0, 0.97), in(0.0, 0.95)};
    const RateCurve curve(limits, most);
    RateGovernor governor;
    governor.begin(curve, in(0.0, 1.0));
    const double period_s = std::pow(10.0, in(-4.5, -3.0));
    for (int k = 0; k < 3000; ++k) {
      if (in(0.0, 1.0) < 0.01) governor.seek(in(-0.5, 1.5));
      const double u = governor.rate(), w = governor.change_1_s(), time_s = governor.time_s();
      governor.advance(period_s);
      ASSERT_GE(governor.rate(), 0.0);
      ASSERT_LE(governor.rate(), 1.0);
      ASSERT_GE(governor.time_s(), time_s);
      ASSERT_LE(governor.time_s(), time_s + period_s * (1.0 + 1e-9));
      const Step step{u, w, governor.rate(), governor.change_1_s(), period_s};
      const double share =
          greatest_share(limits, {std::max(most.speed, 1e-3), most.acceleration, most.jerk}, step);
      ASSERT_LE(share, 1.0 + 1e-6);
      closest = std::max(closest, share);
    }
  }
  EXPECT_GT(closest, 0.99);
}

TEST(RateGovernor, StopsWithinABoundOfRamps) {
  for (const double turn : {0.02, 0.1, 0.3, 0.6, 0.9}) {
    const RateLimit limit{1.0, 1.0, 1.0 / turn};
    const RateCurve curve(std::span(&limit, 1), kFull);
    RateGovernor governor;
    governor.begin(curve, 1.0);
    EXPECT_LT(until_rest_s(governor, 1e-3), 3.1 * (1.0 + turn)) << turn;
    // The worst instant: it speeds up.
    double longest_s = 0.0;
    for (int n = 0; n < 200; ++n) {
      governor.begin(curve, 0.0);
      governor.seek(1.0);
      governor.advance(0.02 * n);
      longest_s = std::max(longest_s, until_rest_s(governor, 1e-3));
    }
    EXPECT_LT(longest_s, 4.0 * (1.0 + turn)) << turn;
  }
}

}  // namespace
}  // namespace corbot::unit_rate_curve_test
