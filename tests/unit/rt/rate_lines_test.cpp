// SPDX-License-Identifier: Apache-2.0
// Lines at all limits, from the planner to the set-points, for arms of every family: the end, a given time,
// refusals, and lines that are hardly any.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <variant>
#include <vector>

#include "../../support/arm_motions.h"
#include "../../support/test_arms.h"
#include "rt/rig.h"

namespace corbot::test::rate_lines_test {
namespace {

class RateLines : public testing::TestWithParam<const char*> {
 protected:
  RateLines() {
    rig.restart({.position_q = motions.there_q, .position_known = true});
    rig.step();
  }
  Vector3 here_m() const { return rig.arm.kinematics.forward(rig.start().position_q).position_m; }
  PlanResult planned(const Vector3& to_m, double t_s = 0.0) {
    return rig.planner.move_s(rig.start(), motions.settings, to_m, t_s);
  }
  Verdict run(const PlanResult& plan) {
    if (const auto* refusal = std::get_if<PlanRefusal>(&plan)) {
      ADD_FAILURE() << refusal->text;
      return Verdict::kLost;
    }
    (void)rig.submit(plan);
    for (int cycle = 0; cycle < 100'000; ++cycle) {
      if (const auto done = rig.completion()) return done->verdict;
      rig.step();
    }
    return Verdict::kLost;
  }

  ArmMotions motions = motions_of(arm_of(GetParam()), 0.05);
  Rig rig{arm_of(GetParam())};
};

TEST_P(RateLines, ArriveWhateverTheirLength) {
  ASSERT_TRUE(motions.line_to_m);
  const Vector3 whole_m = *motions.line_to_m - here_m();
  for (const double part : {1.0, 1e-2, 1e-4, 1e-6, 1e-8, 1e-10, 1e-12, 1e-14, 1e-16}) {
    SCOPED_TRACE(part);
    const Vector3 to_m = here_m() + (part == 1.0 ? 0.9 : 0.1 * part) * whole_m;
    ASSERT_EQ(run(planned(to_m)), Verdict::kDone);
    EXPECT_LE(norm(here_m() - to_m), 1e-14);
    EXPECT_FALSE(rig.alarm());
  }
}

TEST_P(RateLines, LastAsLongAsTheyAreTold) {
  const PlanResult shortest = planned(*motions.line_to_m);
  const Command& command = std::get<std::vector<Command>>(shortest).front();
  ASSERT_EQ(command.kind, MotionKind::kLine);
  EXPECT_GT(command.line.knots.pieces, 0);
  const auto duration_s = [&](double t_s) {
    return std::get<std::vector<Command>>(planned(*motions.line_to_m, t_s)).front().duration_s;
  };
  EXPECT_EQ(duration_s(0.5 * command.duration_s), command.duration_s);
  EXPECT_EQ(duration_s(2.7), 2.7);
  EXPECT_EQ(duration_s(3600.0), 3600.0);
}

TEST_P(RateLines, AreDwellsWithoutTravel) {
  for (const double t_s : {0.0, 0.3}) {
    const PlanResult plan = planned(here_m(), t_s);
    EXPECT_EQ(std::get<std::vector<Command>>(plan).front().duration_s, t_s);
    const Joints before_q = rig.start().position_q;
    ASSERT_EQ(run(plan), Verdict::kDone);
    EXPECT_EQ(rig.start().position_q, before_q);
  }
}

/// A soft limit that the line crosses; the refusal names the joint, and where.
TEST_P(RateLines, KeepSoftLimits) {
  const PlanResult plan = planned(*motions.line_to_m);
  const Joints from_q = rig.start().position_q;
  const Joints to_q = std::get<std::vector<Command>>(plan).front().end_q;
  for (std::size_t i = 0; i < rig.arm.dof; ++i) {
    if (std::abs(to_q[i] - from_q[i]) < 1e-3) continue;
    motions.settings.soft_limits.emplace();
    JointRanges& ranges = *motions.settings.soft_limits;
    for (std::size_t k = 0; k < rig.arm.dof; ++k) {
      ranges.lower_q[k] = rig.arm.joints[k].lower_q;
      ranges.upper_q[k] = rig.arm.joints[k].upper_q;
    }
    const double border_q = 0.3 * from_q[i] + 0.7 * to_q[i];
    (to_q[i] > from_q[i] ? ranges.upper_q : ranges.lower_q)[i] = border_q;
    const PlanResult limited = planned(*motions.line_to_m);
    ASSERT_TRUE(std::holds_alternative<PlanRefusal>(limited));
    const auto& refusal = std::get<PlanRefusal>(limited);
    EXPECT_EQ(refusal.parameter, "joint range") << refusal.text;
    EXPECT_EQ(refusal.joint, static_cast<int>(i));
    EXPECT_NE(refusal.text.find("at the target"), std::string::npos) << refusal.text;
  }
}

TEST_P(RateLines, AreRefusedOutOfReach) {
  const PlanResult plan = planned(here_m() + Vector3{30.0, 0.0, 0.0});
  ASSERT_TRUE(std::holds_alternative<PlanRefusal>(plan));
  const auto& refusal = std::get<PlanRefusal>(plan);
  EXPECT_EQ(refusal.kind == PlanRefusal::Kind::kUnreachable, refusal.joint < 0) << refusal.text;
}

INSTANTIATE_TEST_SUITE_P(Arms, RateLines,
                         testing::Values("lynx5", "al5d_wr", "puma560", "scara_gx4", "stanford",
                                         "cartesian_ppp", "cylindrical_rpp", "polar_rrp", "xarm6"),
                         [](const auto& arm) { return std::string(arm.param); });

}  // namespace
}  // namespace corbot::test::rate_lines_test
