// SPDX-License-Identifier: Apache-2.0
// Reasons of planned motions: the tool's speed, a joint next to the base axis, the tool's turning, a joint
// motion's ruling joint.
#include "planner/reasons.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <variant>
#include <vector>

#include "corbot/motion/path_joints.h"
#include "planner/planner.h"
#include "planner/rate/rate_planner.h"
#include "support/test_arms.h"

namespace corbot::unit_rate_reasons_test {
namespace {

using rate::LimitKind;
using rate::Mover;
using rate::Reason;
using rate::ReasonStretch;

const ArmModel& lynx() {
  static const ArmModel arm = test::arm_of("lynx5");
  return arm;
}

struct Planned {
  Command command{};
  PlannedRate rate;
  [[nodiscard]] std::vector<ReasonStretch> reasons() const {
    return rate::reasons_of(lynx(), {}, command, rate);
  }
};

/// 0.12 m long, past the base axis at a distance of `miss_m`.
Planned line_past_axis(double miss_m, double end_pitch_rad = -1.4, double t_s = 0.0) {
  Planned planned;
  planned.command.kind = MotionKind::kLine;
  LineMotion& line = planned.command.line;
  line.from_m = {miss_m, -0.06, 0.12};
  line.to_m = {miss_m, 0.06, 0.12};
  line.tool.from = {1.0, 0.0, 0.0, 0.0};
  line.tool.from_angles_rad = {-1.4, 0.0};
  line.tool.to_angles_rad = {end_pitch_rad, 0.0};
  const IkSolution ik = joints_at(lynx(), point_at(line, 0.0), line.solution, {});
  EXPECT_EQ(ik.status, IkStatus::kOk);
  const rate::RatePlan plan = std::get<rate::RatePlan>(rate::plan_rate(lynx(), {}, line, ik.joints_q, t_s));
  planned.command.duration_s = plan.law.duration_s();
  planned.rate = {plan.knots, plan.law.pieces()};
  return planned;
}

const ReasonStretch& middle(const std::vector<ReasonStretch>& all) {
  return *std::find_if(all.begin(), all.end(), [](const auto& x) { return x.end_path > 0.5; });
}

TEST(RateReasons, AreTheToolsSpeedInTheMiddleOfALineAwayFromTheAxis) {
  const std::vector<ReasonStretch> all = line_past_axis(0.1).reasons();
  EXPECT_EQ(middle(all).reason, (Reason{Mover::kToolTravel, 0, LimitKind::kSpeed}));
  EXPECT_NEAR(middle(all).share, 1.0, 0.01);
  EXPECT_LT(middle(all).begin_path, 0.4);
  EXPECT_GT(middle(all).end_path, 0.6);
  EXPECT_NE(all.front().reason.limit, LimitKind::kSpeed);
  EXPECT_NE(all.back().reason.limit, LimitKind::kSpeed);
}

TEST(RateReasons, AreTheBaseJointNextToTheAxis) {
  const Planned planned = line_past_axis(0.003);
  const ReasonStretch stretch = middle(planned.reasons());
  EXPECT_EQ(stretch.reason.mover, Mover::kJoint);
  EXPECT_EQ(stretch.reason.joint, 0U);
  EXPECT_GT(stretch.share, 0.9);
  const auto nearest = rate::nearest_singularity(lynx(), planned.command, planned.rate.knots);
  ASSERT_TRUE(nearest);
  EXPECT_NEAR(nearest->path, 0.5, 0.02);
  EXPECT_NEAR(nearest->pivot, 0.003, 0.003);
  EXPECT_NEAR(nearest->point_m[1], 0.12 * (nearest->path - 0.5), 1e-12);
}

TEST(RateReasons, AreTheTurningWhereItNeedsMoreTimeThanTheTravel) {
  const ReasonStretch stretch = middle(line_past_axis(0.1, -2.4).reasons());
  EXPECT_EQ(stretch.reason, (Reason{Mover::kToolTurn, 0, LimitKind::kSpeed}));
}

TEST(RateReasons, FollowEachOtherAndNoneIsShort) {
  for (const double miss_m : {0.1, 0.03, 0.003}) {
    const Planned planned = line_past_axis(miss_m);
    const double whole_s = planned.command.duration_s;
    double end_s = 0.0, end_path = 0.0;
    const Reason* previous = nullptr;
    const std::vector<ReasonStretch> all = planned.reasons();
    for (const ReasonStretch& stretch : all) {
      EXPECT_DOUBLE_EQ(stretch.begin_s, end_s);
      EXPECT_DOUBLE_EQ(stretch.begin_path, end_path);
      EXPECT_GE(stretch.end_s - stretch.begin_s, 0.0099 * whole_s);
      EXPECT_FALSE(previous != nullptr && *previous == stretch.reason);
      EXPECT_GT(stretch.share, 0.0);
      previous = &stretch.reason;
      end_s = stretch.end_s;
      end_path = stretch.end_path;
    }
    EXPECT_NEAR(end_s, whole_s, 1e-9);
    EXPECT_NEAR(end_path, 1.0, 1e-9);
  }
}

TEST(RateReasons, HaveSmallSharesWhereTheCallerAskedForALongerTime) {
  for (const ReasonStretch& stretch : line_past_axis(0.1, -1.4, 5.0).reasons()) EXPECT_LT(stretch.share, 0.3);
}

Command joint_motion(const Joints& target_q, double t_s = 0.0) {
  const PlanResult plan = Planner(lynx()).move_joints({}, {}, target_q, t_s);
  return std::get<std::vector<Command>>(plan).front();
}

TEST(RateReasons, OfAJointMotionAreTheJointThatNeedsAllItsTime) {
  const auto reason = [](const Command& command) { return rate::reason_of(lynx(), {}, command); };
  EXPECT_EQ(reason(joint_motion({0.2, 0.1, 1.5, 0.3})), (Reason{Mover::kJoint, 2, LimitKind::kSpeed}));
  EXPECT_EQ(reason(joint_motion({0.01, 0.002, 0.0, 0.0})), (Reason{Mover::kJoint, 0, LimitKind::kJerk}));
  EXPECT_EQ(reason(joint_motion({0.01, 0.0, 0.0, 0.0}, 4.0)), std::nullopt);
}

}  // namespace
}  // namespace corbot::unit_rate_reasons_test
