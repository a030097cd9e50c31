// SPDX-License-Identifier: Apache-2.0
// Planner and real-time task agree on the tool's limits: every line and arc that is planned is accepted, and
// one whose tool is beyond a limit at any instant, however its law came about, is refused.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <utility>
#include <vector>

#include "corbot/motion/law_evaluation.h"
#include "corbot/motion/path.h"
#include "planner/planner.h"
#include "planner/time_law_planner.h"
#include "rt/cycle/command_check.h"
#include "seed.h"
#include "test_arm.h"

namespace corbot {
namespace {

using Point = std::array<double, 3>;

struct Extremes {
  double speed{}, acceleration{}, jerk{};
};

/// Of the tool's vectors, from samples of the law: what is along and what is across, by circular motion.
Extremes sampled(const TimeLaw& law, double length, double radius_m) {
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

double beyond(const ArmModel& arm, const Extremes& e) {
  return std::max({e.speed / arm.path.speed_m_s, e.acceleration / arm.path.acceleration_m_s2,
                   e.jerk / arm.path.jerk_m_s3});
}

Verdict gate(const ArmModel& arm, Command command) {
  command.id = 1;
  return rt::check_command(arm, command, {0, command.start_q, 0.0}).verdict;
}

/// The same path by another law.
template <class Motion>
Command with_law(Command command, Motion Command::*motion, const TimeLaw& law) {
  (command.*motion).law = law;
  command.duration_s = law.duration_s();
  return command;
}

struct Tally {
  int planned{}, refused{}, centripetal{};
  double tightest{};
};

template <class Motion>
void check_both_sides(const ArmModel& arm, const Command& command, Motion Command::*motion, double radius_m,
                      Tally& tally) {
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

struct Random {
  std::mt19937_64 engine;
  double in(double low, double high) { return std::uniform_real_distribution<double>(low, high)(engine); }
};

TEST(Gate, AcceptsWhatIsPlannedAndRefusesAToolBeyondItsLimits) {
  Random random{std::mt19937_64(test::seed() + 2)};
  Tally lines, arcs;
  const int cases = test::cases(3000);
  for (int i = 0; i < cases; ++i) {
    ArmModel arm = i % 2 == 0 ? test::lynx5() : test::wide_arm();
    if (i % 7 == 0) arm.path.speed_m_s = 2.0;
    PlanStart start;
    for (std::size_t k = 0; k < 4; ++k)
      start.position_q[k] = random.in(arm.joints[k].lower_q, arm.joints[k].upper_q);
    const ToolPose here = tool_pose(arm.kinematics, start.position_q);
    const double size = std::pow(10.0, random.in(-4.0, -1.0));
    Point p2{}, p3{};
    for (std::size_t k = 0; k < 3; ++k) {
      p2[k] = here.position_m[k] + random.in(-size, size);
      p3[k] = here.position_m[k] + random.in(-size, size);
    }
    PlanSettings settings;
    settings.tool_pitch_rad = here.pitch_rad;
    if (i % 3 == 0) settings.speed_ratio = random.in(0.05, 1.0);
    const Planner planner(arm);
    const PlanResult line = planner.move_s(start, settings, p2, i % 9 == 0 ? 2.0 : 0.0);
    if (const auto* commands = std::get_if<std::vector<Command>>(&line)) {
      ASSERT_NO_FATAL_FAILURE(check_both_sides(arm, commands->back(), &Command::line, INFINITY, lines))
          << "case " << i;
    }
    const PlanResult arc = planner.move_c(start, settings, here.position_m, p2, p3);
    if (const auto* commands = std::get_if<std::vector<Command>>(&arc)) {
      const Command& command = commands->back();
      ASSERT_NO_FATAL_FAILURE(check_both_sides(arm, command, &Command::arc, command.arc.radius_m, arcs))
          << "case " << i;
    }
  }
  std::cout << lines.planned << " lines, " << arcs.planned << " arcs; refused " << lines.refused << " and "
            << arcs.refused << ", of these by what is across alone " << arcs.centripetal
            << "; nearest to a limit " << lines.tightest << " and " << arcs.tightest << "\n";
  EXPECT_GT(lines.planned, cases / 5);
  EXPECT_GT(arcs.planned, cases / 8);
  EXPECT_GT(lines.refused, cases / 5);
  EXPECT_GT(arcs.centripetal, cases / 10) << "arcs that only the vector's limit refuses";
  EXPECT_LE(std::max(lines.tightest, arcs.tightest), 1.0 + 1e-6);
}

}  // namespace
}  // namespace corbot
