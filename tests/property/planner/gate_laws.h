// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "corbot/motion/law_evaluation.h"
#include "corbot/motion/path.h"
#include "planner/planner.h"
#include "planner/time_law_planner.h"
#include "rt/cycle/command_check.h"
#include "rt/cycle/knot_check.h"
#include "rt/cycle/path_evaluation.h"

// Whether the real-time task accepts what was planned, and refuses the same path by laws that bring the tool beyond its limits.

namespace corbot::test {

struct Extremes {
  double speed{}, acceleration{}, jerk{};
};

/// Of the tool's vectors, from samples of the law: what is along and what is across, by circular motion.
inline Extremes sampled(const TimeLaw& law, double length, double radius_m) {
  constexpr int kSamples = 4000;
  Extremes found;
  for (int i = 0; i <= kSamples; ++i) {
    const LawState s = evaluate(law, law.duration_s() * i / kSamples);
    const double v = s.velocity * length, a = s.acceleration * length, j = s.jerk * length;
    const double turn = v / radius_m;  // angular rate; 0 on a line, whose radius is infinite
    found.speed = std::max(found.speed, std::abs(v));
    found.acceleration = std::max(found.acceleration, std::hypot(a, v * turn));
    found.jerk = std::max(found.jerk, std::hypot(j - v * turn * turn, 3.0 * a * turn));
  }
  return found;
}

inline double beyond(const ArmModel& arm, const Extremes& e) {
  return std::max({e.speed / arm.path.speed_m_s, e.acceleration / arm.path.acceleration_m_s2,
                   e.jerk / arm.path.jerk_m_s3});
}

/// As the cycle does, a few cells a call. `rate`: of a path that has one.
inline Verdict gate(const ArmModel& arm, Command command, const PlannedRate& rate = {}) {
  command.id = 1;
  const Verdict verdict = rt::check_command(arm, command, {0, command.start_q, 0.0}).verdict;
  if (verdict != Verdict::kDone || rate.pieces.empty()) return verdict;
  ArmModel framed = arm;
  rt::take_frames(command, framed.kinematics);
  const rate::RatePath path{rate.knots, {rate.pieces, command.duration_s, rate.knots.back().lambda_s}};
  rt::RateCheck check;
  for (;;) {
    if (const auto done = check.step(framed, command, path)) return done->verdict;
  }
}

/// The same path by another law.
template <class Motion>
Command with_law(Command command, Motion Command::*motion, const TimeLaw& law) {
  (command.*motion).law = law;
  command.duration_s = law.duration_s();
  return command;
}

struct GateTally {
  int planned{}, refused{}, centripetal{};
  double tightest{};
};

template <class Motion>
void check_both_sides(const ArmModel& arm, const Command& command, Motion Command::*motion, double radius_m,
                      GateTally& tally) {
  ASSERT_EQ(gate(arm, command), Verdict::kDone) << "planned, and refused";
  const double length = length_m(command.*motion);
  if (length < 1e-6) return;
  ++tally.planned;
  tally.tightest = std::max(tally.tightest, beyond(arm, sampled((command.*motion).law, length, radius_m)));
  // Laws that each law's own limits allow, as if the path were straight; and the planned one, run faster.
  std::vector<TimeLaw> laws{plan_law(
      1.0, {arm.path.speed_m_s / length, arm.path.acceleration_m_s2 / length, arm.path.jerk_m_s3 / length})};
  for (const double factor : {0.999, 0.97, 0.8, 0.4})
    laws.push_back(stretch((command.*motion).law, command.duration_s * factor));
  for (const TimeLaw& law : laws) {
    const Extremes extremes = sampled(law, length, radius_m);
    if (beyond(arm, extremes) <= 1.0 + 1e-5) continue;
    ++tally.refused;
    const bool only_across = extremes.speed <= arm.path.speed_m_s &&
                             peaks(law).acceleration * length <= arm.path.acceleration_m_s2 &&
                             peaks(law).jerk * length <= arm.path.jerk_m_s3;
    tally.centripetal += only_across ? 1 : 0;
    ASSERT_EQ(gate(arm, with_law(command, motion, law)), Verdict::kLimit)
        << "speed " << extremes.speed << " m/s, acceleration " << extremes.acceleration << " m/s2, jerk "
        << extremes.jerk << " m/s3, radius " << radius_m << " m";
  }
}

}  // namespace corbot::test
