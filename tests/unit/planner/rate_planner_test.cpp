// SPDX-License-Identifier: Apache-2.0
// Plans at the limits: within the reserves, quick past an axis, in a given time, and at rest where there is
// nothing to travel.
#include "planner/rate/rate_planner.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <utility>
#include <variant>

#include "corbot/kinematics/tool_pose.h"
#include "corbot/motion/path_joints.h"
#include "planner/rate/optimum.h"
#include "support/test_arms.h"

namespace corbot::unit_rate_planner_test {
namespace {

using rate::Limits;
using rate::plan_rate;
using rate::RatePlan;

const ArmModel& lynx() {
  static const ArmModel arm = test::arm_of("lynx5");
  return arm;
}

struct LineFrom {
  LineMotion line{};
  Joints start_q{};
};

/// 0.12 m long, past the base axis at a distance of `miss_m`.
LineFrom past_axis(double miss_m) {
  LineFrom from;
  from.line.from_m = {miss_m, -0.06, 0.12};
  from.line.to_m = {miss_m, 0.06, 0.12};
  from.line.tool.from = {1.0, 0.0, 0.0, 0.0};
  from.line.tool.from_angles_rad = from.line.tool.to_angles_rad = {-1.4, 0.0};
  const IkSolution ik = joints_at(lynx(), point_at(from.line, 0.0), from.line.solution, {});
  EXPECT_EQ(ik.status, IkStatus::kOk);
  from.start_q = ik.joints_q;
  return from;
}

RatePlan planned(const LineFrom& from, double t_s = 0.0) {
  return std::get<RatePlan>(plan_rate(lynx(), {}, from.line, from.start_q, t_s));
}

TEST(RatePlanner, SlowsDownOnlyNextToTheBaseAxis) {
  double last_s = 1.0;
  for (const auto& [miss_m, most_s] : {std::pair{0.03, 1.3}, {0.01, 1.6}, {0.003, 1.9}, {0.0003, 2.3}}) {
    const RatePlan plan = planned(past_axis(miss_m));
    EXPECT_GT(plan.law.duration_s(), last_s) << miss_m;
    EXPECT_LT(plan.law.duration_s(), most_s) << miss_m;
    last_s = plan.law.duration_s();
  }
}

TEST(RatePlanner, LaterRoundsMakeItQuicker) {
  double first_s = 0.0, best_s = 0.0;
  for (const double miss_m : {0.02, 0.01, 0.005, 0.003, 0.002}) {
    const LineFrom from = past_axis(miss_m);
    const RatePlan plan = planned(from);
    const Limits limits = rate::reserved(rate::limits_of(lynx(), {}, from.line));
    rate::Optimum optimum(rate::Grid(plan.knots, limits));
    optimum.run(1e-2);
    const rate::RateLaw law = optimum.law();
    const double stretched_s = law.duration_s() * prove(law, plan.knots, limits).factor;
    EXPECT_LE(plan.law.duration_s(), stretched_s * (1.0 + 1e-9)) << miss_m;
    first_s += stretched_s;
    best_s += plan.law.duration_s();
  }
  EXPECT_LT(best_s, 0.97 * first_s);
}

TEST(RatePlanner, LeavesTheReservesAndNoMore) {
  const LineFrom from = past_axis(0.01);
  const RatePlan plan = planned(from);
  const rate::Shares most =
      std::accumulate(plan.shares.begin(), plan.shares.end(), rate::Shares{}, rate::greater);
  EXPECT_LE(most.speed, 1.0);
  EXPECT_LE(most.acceleration, 0.97);
  EXPECT_LE(most.jerk, 0.95);
  EXPECT_GT(most.acceleration, 0.95);
  EXPECT_GT(most.jerk, 0.93);
}

TEST(RatePlanner, LastsExactlyAsLongAsItIsTold) {
  const LineFrom from = past_axis(0.01);
  const double shortest_s = planned(from).law.duration_s();
  EXPECT_EQ(planned(from, 0.9 * shortest_s).law.duration_s(), shortest_s);
  for (const double t_s : {1.001 * shortest_s, 3.3, 700.7}) {
    const RatePlan plan = planned(from, t_s);
    EXPECT_EQ(plan.law.duration_s(), t_s);
    EXPECT_EQ(plan.law.at(t_s).lambda_s, plan.knots.back().lambda_s);
    EXPECT_EQ(plan.law.at(t_s).v, 0.0);
    EXPECT_LE(prove(plan.law, plan.knots, rate::limits_of(lynx(), {}, from.line)).factor,
              1.0001 * shortest_s / t_s);
  }
}

TEST(RatePlanner, RestsWhereThereIsNothingToTravel) {
  LineFrom from = past_axis(0.01);
  from.line.to_m = from.line.from_m;
  for (const double t_s : {0.0, 2.5}) {
    const RatePlan plan = planned(from, t_s);
    EXPECT_EQ(plan.law.duration_s(), t_s);
    EXPECT_EQ(plan.law.at(0.5 * t_s).lambda_s, 0.0);
    const rate::State z = rate::Cell(plan.knots.front(), plan.knots.back()).at(0.0);
    for (std::size_t i = 0; i < lynx().dof; ++i) EXPECT_EQ(z[i], from.start_q[i]);
    EXPECT_LE(prove(plan.law, plan.knots, rate::limits_of(lynx(), {}, from.line)).factor, 1.0);
  }
}

/// From the stretched arm and past the base axis, where joints are quick beside a slow path.
TEST(RatePlanner, PlansAtEverySpeed) {
  const LineFrom past = past_axis(0.003);
  LineFrom up = past;
  up.start_q = {};
  const Pose there = lynx().kinematics.forward(up.start_q);
  up.line.from_m = there.position_m;
  up.line.to_m = there.position_m + Vector3{0.0, 0.0, 0.039};
  up.line.tool.from_angles_rad = lynx().kinematics.followed().at(up.start_q);
  up.line.tool.to_angles_rad[0] = angle_of_pitch(lynx().kinematics, 0.0);
  for (const LineFrom& from : {past, up}) {
    const double full_s = planned(from).law.duration_s();
    for (const double ratio : {0.1, 0.01, 0.001}) {
      SCOPED_TRACE(ratio);
      const auto slow = plan_rate(lynx(), {.speed_ratio = ratio}, from.line, from.start_q, 0.0);
      ASSERT_TRUE(std::holds_alternative<RatePlan>(slow)) << std::get<PlanRefusal>(slow).text;
      EXPECT_GT(std::get<RatePlan>(slow).law.duration_s(), full_s);
      EXPECT_LT(std::get<RatePlan>(slow).law.duration_s(), full_s / ratio);
    }
  }
}

TEST(RatePlanner, RefusesWhatTheGeometryRefuses) {
  LineFrom from = past_axis(0.01);
  from.line.to_m = {2.0, 0.1, 0.12};
  EXPECT_TRUE(std::holds_alternative<PlanRefusal>(plan_rate(lynx(), {}, from.line, from.start_q, 0.0)));
}

}  // namespace
}  // namespace corbot::unit_rate_planner_test
