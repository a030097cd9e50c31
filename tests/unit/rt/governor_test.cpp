// SPDX-License-Identifier: Apache-2.0
#include "rt/cycle/governor.h"

#include <gtest/gtest.h>

#include <cmath>

#include "corbot/motion/law_evaluation.h"
#include "planner/time_law_planner.h"

namespace corbot::test::governor_test {
namespace {

constexpr double kDt = 1e-3;
constexpr LawLimits kLimits{2.0, 10.0, 100.0};
constexpr double kScale_s = 2.0 / 10.0 + 10.0 / 100.0;

rt::GovernedMotion motion_of(const TimeLaw& law) {
  rt::GovernedMotion motion;
  motion.laws[0] = {rt::LawSegments(law), kLimits.acceleration, kLimits.jerk};
  motion.count = 1;
  motion.duration_s = law.duration_s();
  return motion;
}

rt::GovernedMotion dwell_of(double duration_s) {
  rt::GovernedMotion motion;
  motion.duration_s = duration_s;
  return motion;
}

TEST(LawSegments, AreTheLaw) {
  const TimeLaw law = plan_law(-3.0, kLimits);
  const rt::LawSegments segments(law);
  std::size_t segment = 0;
  for (double t = 0.0; t < law.duration_s(); t += 1.37e-3) {
    segment = segments.segment_at(t, segment);
    const LawState state = evaluate(law, t);
    EXPECT_NEAR(segments.velocity(segment, t), state.velocity, 1e-12);
    EXPECT_NEAR(segments.acceleration(segment, t), state.acceleration, 1e-11);
  }
  EXPECT_NEAR(segments.velocity(6, law.duration_s()), 0.0, 1e-12);
  EXPECT_NEAR(segments.acceleration(6, law.duration_s() + 1), 0.0, 1e-11);
}

TEST(Governor, RunsAtFullRateToTheEnd) {
  rt::Governor governor;
  const TimeLaw law = plan_law(3.0, kLimits);
  governor.begin(motion_of(law));
  const int ticks = static_cast<int>(std::ceil(law.duration_s() / kDt));
  for (int i = 0; i < ticks - 1; ++i) governor.advance(kDt);
  EXPECT_FALSE(governor.finished());
  EXPECT_NEAR(governor.virtual_time_s(), (ticks - 1) * kDt, 1e-12);
  governor.advance(kDt);
  governor.advance(kDt);
  EXPECT_TRUE(governor.finished());
  EXPECT_EQ(governor.virtual_time_s(), law.duration_s());
}

TEST(Governor, WithNothingMovingTheRateIsSetAtOnce) {
  rt::Governor governor;
  governor.set_target(0.3);
  governor.begin(motion_of(plan_law(3.0, kLimits)));
  EXPECT_EQ(governor.rate(), 0.3);
  governor.set_target(0.0);
  governor.begin(motion_of(plan_law(3.0, kLimits)));
  EXPECT_TRUE(governor.holding());
}

TEST(Governor, ADwellStopsAtOnce) {
  rt::Governor governor;
  governor.begin(dwell_of(10.0));
  governor.advance(kDt);
  governor.set_target(0.0);
  governor.advance(kDt);
  EXPECT_TRUE(governor.holding());
  EXPECT_EQ(governor.virtual_time_s(), kDt);
}

/// From every instant of the law: a stop ends within its bound and keeps the limits, and a resume comes to
/// the end.
void stop_everywhere(const TimeLaw& law, double override_ratio) {
  double worst_stop_s = 0.0;
  for (double instant_s = 0.0; instant_s < law.duration_s() / override_ratio; instant_s += 3.1e-3) {
    rt::Governor governor;
    governor.set_target(override_ratio);
    governor.begin(motion_of(law));
    while (governor.virtual_time_s() < instant_s * override_ratio && !governor.finished())
      governor.advance(kDt);
    const double natural_s = (law.duration_s() - governor.virtual_time_s()) / override_ratio;
    double history[4] = {};
    for (double& q : history) q = evaluate(law, governor.virtual_time_s()).position;
    int known = 0;
    governor.set_target(0.0);
    double stop_s = 0.0;
    const auto tick = [&] {
      governor.advance(kDt);
      for (int i = 3; i > 0; --i) history[i] = history[i - 1];
      history[0] = evaluate(law, governor.virtual_time_s()).position;
      ++known;
      const double a = (history[0] - 2 * history[1] + history[2]) / (kDt * kDt);
      const double j = (history[0] - 3 * history[1] + 3 * history[2] - history[3]) / (kDt * kDt * kDt);
      if (known >= 2) {
        ASSERT_LE(std::abs(a), kLimits.acceleration * (1 + 1e-4)) << instant_s;
      }
      if (known >= 3) {
        ASSERT_LE(std::abs(j), kLimits.jerk * (1 + 1e-4) + 1e-4) << instant_s;
      }
    };
    while (!governor.holding() && !governor.finished() && stop_s < 10.0) {
      ASSERT_NO_FATAL_FAILURE(tick());
      stop_s += kDt;
    }
    ASSERT_LE(stop_s, natural_s + 2 * kDt);
    ASSERT_LE(stop_s, rt::Governor::kStopBound * kScale_s + kDt) << instant_s;
    worst_stop_s = std::max(worst_stop_s, stop_s);
    governor.set_target(1.0);
    for (int i = 0; i < 20000 && !governor.finished(); ++i) ASSERT_NO_FATAL_FAILURE(tick());
    ASSERT_TRUE(governor.finished()) << "never resumed from " << instant_s;
  }
  ::testing::Test::RecordProperty("worst_stop_share", std::to_string(worst_stop_s / kScale_s));
}

TEST(Governor, StopsAndResumesFromEveryInstantOfALongLaw) { stop_everywhere(plan_law(3.0, kLimits), 1.0); }
TEST(Governor, StopsAndResumesFromEveryInstantOfAShortLaw) { stop_everywhere(plan_law(0.3, kLimits), 1.0); }
TEST(Governor, StopsAndResumesFromEveryInstantOfATriangle) { stop_everywhere(plan_law(0.02, kLimits), 1.0); }
TEST(Governor, StopsAndResumesFromEveryInstantUnderOverride) { stop_everywhere(plan_law(1.0, kLimits), 0.4); }
TEST(Governor, StopsAndResumesFromEveryInstantOfASlowLaw) {
  stop_everywhere(stretch(plan_law(1.0, kLimits), 4.0), 1.0);
}

TEST(Governor, IsWhollyStillWhenItHolds) {
  rt::Governor governor;
  governor.begin(motion_of(plan_law(3.0, kLimits)));
  for (int i = 0; i < 400; ++i) governor.advance(kDt);
  governor.set_target(0.0);
  for (int i = 0; i < 2000; ++i) governor.advance(kDt);
  ASSERT_TRUE(governor.holding());
  const double there_s = governor.virtual_time_s();
  governor.advance(kDt);
  EXPECT_EQ(governor.virtual_time_s(), there_s);
  EXPECT_EQ(governor.rate(), 0.0);
}

TEST(Governor, TheRateNeverLeavesItsRange) {
  rt::Governor governor;
  const TimeLaw law = plan_law(30.0, kLimits);
  governor.begin(motion_of(law));
  double last_s = 0.0;
  for (int i = 0; !governor.finished() && i < 100000; ++i) {
    if (i % 37 == 0) governor.set_target(static_cast<double>((i / 37 * 7) % 11) / 10.0);
    governor.advance(kDt);
    ASSERT_GE(governor.rate(), 0.0);
    ASSERT_LE(governor.rate(), 1.0);
    ASSERT_GE(governor.virtual_time_s(), last_s);
    ASSERT_LE(governor.virtual_time_s() - last_s, kDt * (1 + 1e-12));
    last_s = governor.virtual_time_s();
  }
  EXPECT_TRUE(governor.finished());
}

}  // namespace
}  // namespace corbot::test::governor_test
