// SPDX-License-Identifier: Apache-2.0
// Random lines and arcs of all kinds of arm at their limits: every limit of every joint and of the tool at every tick, the tool on its
// path, and exact ends. Singular starts are among them.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <string>
#include <variant>

#include "corbot/kinematics/tool_pose.h"
#include "corbot/motion/path.h"
#include "limit_ticks.h"
#include "planner/planner.h"
#include "planner/rate/rate_planner.h"
#include "seed.h"
#include "support/test_arms.h"

namespace corbot::property_rates_test {
namespace {

using rate::kPath;
using rate::RatePlan;

constexpr double kWithin = 1.000'01;

/// z of a plan at a time, clamped to its duration.
rate::State state_of(const RatePlan& plan, double t_s) {
  const double lambda_s = plan.law.at(t_s).lambda_s;
  if (lambda_s >= plan.knots.back().lambda_s) return plan.knots.back().z;
  const auto next = std::upper_bound(plan.knots.begin() + 1, plan.knots.end() - 1, lambda_s,
                                     [](double x, const rate::Knot& knot) { return x < knot.lambda_s; });
  const rate::Cell cell(*(next - 1), *next);
  return cell.at((lambda_s - (next - 1)->lambda_s) / cell.length_s());
}
Joints joints_in(const rate::State& z) {
  Joints q{};
  std::copy_n(z.begin(), q.size(), q.begin());
  return q;
}

class Rates : public testing::TestWithParam<const char*> {
 protected:
  double in(double low, double high) { return std::uniform_real_distribution<double>(low, high)(random_); }
  Vector3 near(const Vector3& p, double size) {
    return {p[0] + in(-size, size), p[1] + in(-size, size), p[2] + in(-size, size)};
  }
  /// Every fourth case starts with all joints at 0, where most arms are stretched.
  PlanStart start(int i) {
    PlanStart from;
    for (std::size_t k = 0; i % 4 != 0 && k < arm_.dof; ++k)
      from.position_q[k] = in(arm_.joints[k].lower_q, arm_.joints[k].upper_q);
    return from;
  }
  PlanSettings settings(int i, const PlanStart& from) {
    PlanSettings s;
    if (i % 3 == 0) s.speed_ratio = in(0.05, 1.0);
    if (i % 5 == 0) s.joint_speed_ratio[static_cast<std::size_t>(i / 5) % arm_.dof] = in(0.05, 1.0);
    const Pose here = arm_.kinematics.forward(from.position_q);
    const Vector3 axis{in(-1, 1), in(-1, 1), in(-1, 1)};
    if (i % 2 == 0 && arm_.kinematics.follows() == Follows::kFull)
      s.tool_orientation = about((1.0 / norm(axis)) * axis, in(-0.5, 0.5)) * here.orientation;
    if (arm_.kinematics.follows() == Follows::kPitchAndRoll && i % 2 == 0) s.tool_pitch_rad = in(-1.0, 1.0);
    if (arm_.kinematics.follows() == Follows::kPitch)
      s.tool_pitch_rad = tool_pose(arm_.kinematics, from.position_q).pitch_rad + (i % 2) * in(-0.5, 0.5);
    return s;
  }

  template <class Motion>
  void check_path(const Motion& motion, const RatePlan& plan) {
    constexpr int kPoints = 100;
    for (int k = 0; k <= kPoints; ++k) {
      const rate::State z = state_of(plan, plan.law.duration_s() * k / kPoints);
      const PathPoint wanted = point_at(motion, z[kPath]);
      const Pose there = arm_.kinematics.forward(joints_in(z));
      ASSERT_LE(norm(there.position_m - wanted.position_m), 1e-6);
      if (arm_.kinematics.follows() == Follows::kFull) {
        ASSERT_LE(angle_between(there.orientation, wanted.orientation), 1e-6);
      }
    }
  }

  template <class Motion>
  void check(const PlanSettings& s, const Command& command, const Motion& motion, double t_s) {
    auto planned = rate::plan_rate(arm_, s, motion, command.start_q, t_s);
    if (std::holds_alternative<PlanRefusal>(planned)) {
      ++refused_;
      return;
    }
    const auto& plan = std::get<RatePlan>(planned);
    ASSERT_GE(plan.law.duration_s(), t_s);
    const auto set_points = [&](double at_s) { return std::optional(joints_in(state_of(plan, at_s))); };
    const test::TickShares shares = test::LimitTicks(arm_, s, true, plan.law.duration_s(), set_points).run();
    all_.take(shares.joint());
    tool_.take(shares.tool);
    tool_.take(shares.turning);
    check_path(motion, plan);
    const rate::State end = state_of(plan, plan.law.duration_s());
    ASSERT_EQ(end[kPath], 1.0);
    for (std::size_t i = 0; i < arm_.dof; ++i) {
      ASSERT_EQ(plan.knots.front().z[i], command.start_q[i]);
      ASSERT_NEAR(end[i], command.end_q[i], 1e-9);
    }
    ++planned_;
  }

  ArmModel arm_ = test::arm_of(GetParam());
  std::mt19937_64 random_{test::seed() + 11};
  test::LimitShares all_, tool_;
  int planned_{}, refused_{};
};

TEST_P(Rates, KeepEveryLimitAtEveryTick) {
  const int cases = test::cases(400);
  for (int i = 0; i < cases; ++i) {
    SCOPED_TRACE(i);
    const PlanStart from = start(i);
    const PlanSettings s = settings(i, from);
    const Vector3 here = arm_.kinematics.forward(from.position_q).position_m;
    const double size = i % 8 < 4 ? 0.1 : 0.02;
    const Vector3 p2 = near(here, size), p3 = near(here, size);
    const Planner planner(arm_);
    const PlanResult result =
        i % 3 < 2 ? planner.move_s(from, s, p2, 0.0) : planner.move_c(from, s, here, p2, p3);
    if (std::holds_alternative<PlanRefusal>(result)) continue;
    const double t_s = i % 7 == 0 ? in(0.0, 4.0) : 0.0;
    for (const Command& command : std::get<std::vector<Command>>(result)) {
      if (command.kind == MotionKind::kLine) {
        ASSERT_NO_FATAL_FAILURE(check(s, command, command.line, t_s));
      } else if (command.kind == MotionKind::kArc) {
        ASSERT_NO_FATAL_FAILURE(check(s, command, command.arc, t_s));
      }
    }
  }
  std::cout << planned_ << " planned, " << refused_ << " refused; joints " << all_.speed << " "
            << all_.acceleration << " " << all_.jerk << ", tool " << tool_.speed << " " << tool_.acceleration
            << " " << tool_.jerk << "\n";
  EXPECT_GT(planned_, cases / 10);
  EXPECT_LE(refused_, planned_ / 20);
  EXPECT_LE(std::max(all_.greatest(), tool_.greatest()), kWithin);
  // The reserves, and not much more: a limit is reached in each case.
  EXPECT_LE(std::max(all_.acceleration, tool_.acceleration), 0.97 * kWithin);
  EXPECT_LE(std::max(all_.jerk, tool_.jerk), 0.95 * kWithin);
  EXPECT_GT(std::max(all_.jerk, tool_.jerk), 0.9);
}

INSTANTIATE_TEST_SUITE_P(Arms, Rates,
                         testing::Values("lynx5", "al5d_wr", "puma560", "scara_gx4", "stanford",
                                         "cartesian_ppp", "cylindrical_rpp", "polar_rrp", "xarm6"),
                         [](const auto& arm) { return std::string(arm.param); });

}  // namespace
}  // namespace corbot::property_rates_test
