// SPDX-License-Identifier: Apache-2.0
// Planner and real-time task agree on the tool's limits: every line and arc that is planned is accepted, and
// one whose tool is beyond a limit at any instant, however its law came about, is refused.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <utility>
#include <vector>

#include "gate_laws.h"
#include "planner/planner.h"
#include "seed.h"
#include "test_arm.h"

namespace corbot::property_gate_test {
namespace {

using Point = std::array<double, 3>;

struct Random {
  std::mt19937_64 engine;
  double in(double low, double high) { return std::uniform_real_distribution<double>(low, high)(engine); }
};

TEST(Gate, AcceptsWhatIsPlannedAndRefusesAToolBeyondItsLimits) {
  Random random{std::mt19937_64(test::seed() + 2)};
  test::GateTally lines, arcs;
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
    const Planner planner(arm, PathTiming::kLaw);
    const PlanResult line = planner.move_s(start, settings, p2, i % 9 == 0 ? 2.0 : 0.0);
    if (const auto* commands = std::get_if<std::vector<Command>>(&line)) {
      ASSERT_NO_FATAL_FAILURE(test::check_both_sides(arm, commands->back(), &Command::line, INFINITY, lines))
          << "case " << i;
    }
    const PlanResult arc = planner.move_c(start, settings, here.position_m, p2, p3);
    if (const auto* commands = std::get_if<std::vector<Command>>(&arc)) {
      const Command& command = commands->back();
      ASSERT_NO_FATAL_FAILURE(test::check_both_sides(arm, command, &Command::arc, command.arc.radius_m, arcs))
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
}  // namespace corbot::property_gate_test
