// SPDX-License-Identifier: Apache-2.0
#include "rt/cycle/path_stop.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "corbot/motion/law_evaluation.h"
#include "planner/time_law_planner.h"
#include "rt/cycle/governor.h"

namespace corbot::test::path_stop_test {
namespace {

constexpr double kDt = 1e-3;
constexpr LawLimits kLimits{3.0, 15.0, 140.0};

rt::GovernedMotion motion_of(const std::vector<TimeLaw>& laws) {
  rt::GovernedMotion motion;
  for (const TimeLaw& law : laws) {
    motion.laws[motion.count++] = {rt::LawSegments(law), kLimits.acceleration, kLimits.jerk};
    motion.duration_s = std::max(motion.duration_s, law.duration_s());
  }
  return motion;
}

/// Runs it to this virtual time.
rt::Governor running(const rt::GovernedMotion& motion, double until_s) {
  rt::Governor governor;
  governor.begin(motion);
  while (governor.virtual_time_s() < until_s) governor.advance(kDt);
  return governor;
}

int cycles_to_rest(rt::Governor* governor) {
  governor->set_target(0.0);
  int cycles = 0;
  for (; !governor->holding() && !governor->finished() && cycles < 5000; ++cycles) governor->advance(kDt);
  return cycles;
}

TEST(StopLaw, IsItsOwnDerivatives) {
  constexpr double kStep_s = 1e-5;
  for (const double velocity : {2.0, 0.5, 0.01, -1.5}) {
    for (const double acceleration : {12.0, 0.0, -3.0}) {
      const rt::StopLaw law(velocity, acceleration, kLimits.acceleration, kLimits.jerk);
      EXPECT_EQ(law.way(0.0), 0.0);
      EXPECT_NEAR(law.velocity(0.0), velocity, 1e-12);
      EXPECT_NEAR(law.acceleration(0.0), acceleration, 1e-10);
      EXPECT_EQ(law.velocity(law.duration_s()), 0.0);
      EXPECT_EQ(law.acceleration(law.duration_s()), 0.0);
      for (double t_s = kStep_s; t_s < law.duration_s(); t_s += 1.7e-3) {
        const double slope = (law.way(t_s + kStep_s) - law.way(t_s - kStep_s)) / (2.0 * kStep_s);
        EXPECT_NEAR(slope, law.velocity(t_s), 1e-6) << t_s;
        const double change = (law.velocity(t_s + kStep_s) - law.velocity(t_s - kStep_s)) / (2.0 * kStep_s);
        EXPECT_NEAR(change, law.acceleration(t_s), 1e-3) << t_s;
        EXPECT_LE(std::abs(law.acceleration(t_s)), kLimits.acceleration * (1 + 1e-12));
      }
    }
  }
}

TEST(LawSegments, FindTheTimeOfAPosition) {
  const TimeLaw law = plan_law(-1.3, kLimits);
  const rt::LawSegments segments(law);
  std::size_t segment = 0;
  for (double t_s = 1e-4; t_s < law.duration_s(); t_s += 1.7e-3) {
    const double position = std::abs(evaluate(law, t_s).position);
    const double found_s = segments.time_at(position, &segment);
    EXPECT_NEAR(std::abs(evaluate(law, found_s).position), position, 1e-15) << t_s;
  }
  EXPECT_NEAR(segments.distance(), 1.3, 1e-15);
}

TEST(PathStop, OfOneLawTakesNoLongerThanTheLawAlone) {
  const rt::GovernedMotion motion = motion_of({plan_law(-3.0, kLimits)});
  for (double until_s = 0.01; until_s < 0.6; until_s += 0.0137) {
    rt::Governor governor = running(motion, until_s);
    const rt::RateState now{governor.virtual_time_s(), 1.0, 0.0};
    EXPECT_NEAR(cycles_to_rest(&governor) * kDt, shortest_stop_s(motion, now), 1.1 * kDt) << until_s;
  }
}

TEST(PathStop, BeginsWhileTheLawAccelerates) {
  const rt::GovernedMotion motion = motion_of({plan_law(3.0, kLimits)});
  const rt::LawSegments& law = motion.laws[0].law;
  rt::Governor governor = running(motion, 0.1);
  const double speed_then =
      law.velocity(law.segment_at(governor.virtual_time_s(), 0), governor.virtual_time_s());
  governor.set_target(0.0);
  double highest = 0.0;
  for (int i = 0; i < 5000 && !governor.holding(); ++i) {
    governor.advance(kDt);
    const double time_s = governor.virtual_time_s();
    highest = std::max(highest, governor.rate() * law.velocity(law.segment_at(time_s, 0), time_s));
  }
  EXPECT_LE(highest, speed_then + kLimits.acceleration * kLimits.acceleration / (2.0 * kLimits.jerk));
}

/// The first law gives up its acceleration while the other one still raises it.
TEST(PathStop, GoesStepwiseWhereOneLawHasNoRoom) {
  const TimeLaw first = plan_law(0.45, kLimits);
  const TimeLaw other =
      stretch(plan_law(0.43, {1.4, kLimits.acceleration, kLimits.jerk}), first.duration_s());
  const rt::GovernedMotion motion = motion_of({first, other});
  int stepwise = 0;
  for (double until_s = 0.02; until_s < first.duration_s() / 2; until_s += 0.003) {
    rt::Governor governor = running(motion, until_s);
    const rt::RateState now{governor.virtual_time_s(), 1.0, 0.0};
    const auto best = [&](rt::PathStop::Turn turn) {
      int samples = 100000;
      double best_s = 10.0;
      for (std::size_t leader = 0; leader < motion.count; ++leader) {
        for (const double share : {1.0, 0.9, 0.8, 0.6, 0.4}) {
          rt::PathStop stop(motion, now, leader, share);
          if (stop.plan(motion, turn, {best_s, 1.0}, &samples)) best_s = stop.duration_s();
        }
      }
      return best_s;
    };
    if (best(rt::PathStop::Turn::kStepwise) < 0.97 * best(rt::PathStop::Turn::kAtOnce)) ++stepwise;
    EXPECT_LE(cycles_to_rest(&governor) * kDt, 2.0 * shortest_stop_s(motion, now)) << until_s;
  }
  EXPECT_GT(stepwise, 0);
}

/// One law still accelerates when another one brakes. The rate of these stops rises between two samples.
TEST(PathStop, GoesNoFasterThanTheMotion) {
  struct Case {
    double until_s;
    std::array<double, 3> distances, speeds;
  };
  for (const Case& of : {Case{0.116, {0.838912, 0.582145, 1.030118}, {1.982423, 2.226177, 2.809565}},
                         Case{0.133, {1.576862, 1.155063, 1.390095}, {2.105710, 2.105868, 2.927845}}}) {
    std::vector<TimeLaw> laws;
    for (std::size_t i = 0; i < of.speeds.size(); ++i)
      laws.push_back(plan_law(of.distances[i], {of.speeds[i], kLimits.acceleration, kLimits.jerk}));
    const double duration_s = motion_of(laws).duration_s;
    for (TimeLaw& law : laws) law = stretch(law, duration_s);
    rt::Governor governor = running(motion_of(laws), of.until_s);
    governor.set_target(0.0);
    double fastest = 0.0;
    for (int cycle = 0; cycle < 5000 && !governor.holding(); ++cycle) {
      const double before_s = governor.virtual_time_s();
      governor.advance(kDt);
      fastest = std::max(fastest, (governor.virtual_time_s() - before_s) / kDt);
    }
    EXPECT_TRUE(governor.holding());
    EXPECT_LE(fastest - 1.0, 1e-6) << of.until_s;
  }
}

TEST(PathStop, LooksAtNoMoreSamplesThanItMay) {
  const rt::GovernedMotion motion = motion_of({plan_law(1.0, kLimits), stretch(plan_law(0.2, kLimits), 1.0)});
  rt::PathStop stop(motion, {0.1, 1.0, 0.0}, 0, 1.0);
  int samples = 3;
  EXPECT_FALSE(stop.plan(motion, rt::PathStop::Turn::kAtOnce, {10.0, 1.0}, &samples));
  EXPECT_GE(samples, -1);
}

TEST(Governor, AStopBeforeAnythingMovesIsOverAtOnce) {
  rt::Governor governor;
  governor.begin(motion_of({plan_law(1.0, kLimits)}));
  governor.set_target(0.0);
  governor.advance(kDt);
  EXPECT_TRUE(governor.holding());
  EXPECT_EQ(governor.virtual_time_s(), 0.0);
}

TEST(Governor, ResumesInTheMiddleOfAStop) {
  const rt::GovernedMotion motion = motion_of({plan_law(2.0, kLimits), plan_law(1.2, kLimits)});
  for (int cycles = 1; cycles < 300; cycles += 7) {
    rt::Governor governor = running(motion, 0.15);
    governor.set_target(0.0);
    for (int i = 0; i < cycles; ++i) governor.advance(kDt);
    governor.set_target(1.0);
    for (int i = 0; i < 5000 && !governor.finished(); ++i) governor.advance(kDt);
    EXPECT_TRUE(governor.finished()) << cycles;
  }
}

}  // namespace
}  // namespace corbot::test::path_stop_test
