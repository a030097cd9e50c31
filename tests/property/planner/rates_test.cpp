// SPDX-License-Identifier: Apache-2.0
// Runs random lines and arcs of all kinds of arm at their limits. It checks every limit of every joint and of
// the tool at every tick, the tool's path, and exact ends. Singular starts are among them, and lines through
// a singular wrist.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <string>
#include <variant>

#include "corbot/motion/path.h"
#include "corbot/motion/path_joints.h"
#include "corbot/units.h"
#include "limit_ticks.h"
#include "random_rates.h"

namespace corbot::property_rates_test {
namespace {

using rate::kPath;
using rate::RatePlan;
using test::joints_in;
using test::state_of;

constexpr double kWithin = 1.000'01;

class Rates : public test::RandomRates {
 protected:
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

  /// `end_q`: where it must end.
  template <class Motion>
  void check(const PlanSettings& s, const Motion& motion, const Joints& start_q,
             const std::optional<Joints>& end_q, double t_s) {
    const auto planned = rate::plan_rate(arm_, s, motion, start_q, t_s);
    if (std::holds_alternative<PlanRefusal>(planned)) {
      ++refused_;
      refused_at_m_ = std::get<PlanRefusal>(planned).target_m;
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
      ASSERT_EQ(plan.knots.front().z[i], start_q[i]);
      if (end_q) {
        ASSERT_NEAR(end[i], (*end_q)[i], 1e-9);
      }
    }
    ++planned_;
  }

  test::LimitShares all_, tool_;
  int planned_{}, refused_{};
  Vector3 refused_at_m_{};  ///< the last one
};

TEST_P(Rates, KeepEveryLimitAtEveryTick) {
  const int cases = test::cases(400);
  for (int i = 0; i < cases; ++i) {
    SCOPED_TRACE(i);
    const auto [s, commands] = random_case(i);
    const double t_s = i % 7 == 0 ? in(0.0, 4.0) : 0.0;
    for (const Command& command : commands) {
      if (command.kind == MotionKind::kLine) {
        ASSERT_NO_FATAL_FAILURE(check(s, command.line, command.start_q, command.end_q, t_s));
      } else if (command.kind == MotionKind::kArc) {
        ASSERT_NO_FATAL_FAILURE(check(s, command.arc, command.start_q, command.end_q, t_s));
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

class RatesThroughWrist : public Rates {
 protected:
  /// A line that leads at this distance past a place where axes 4 and 6 are in one line. Some leave the reach
  /// elsewhere. Some come near such a place once more.
  void check_line(double miss_m) {
    constexpr double kInLine_q = to_radians(-45.0);
    Joints there_q = start(1).position_q;
    for (double& q : there_q) q *= 0.6;
    there_q[4] = kInLine_q;
    const Pose there = arm_.kinematics.forward(there_q);
    const Vector3 way = near({}, 0.15), across = cross(way, near({}, 1.0));
    LineMotion line{};
    line.from_m = there.position_m + (miss_m / norm(across)) * across - in(0.3, 0.7) * way;
    line.to_m = line.from_m + way;
    line.tool.from = there.orientation;
    there_q[4] += in(0.0, 1.0) < 0.5 ? 0.3 : -0.3;
    line.solution = *arm_.kinematics.solution_of(there_q);
    const IkSolution ik = joints_at(arm_, point_at(line, 0.0), line.solution, there_q);
    if (ik.status != IkStatus::kOk) return;
    const int refused = refused_;
    check({}, line, ik.joints_q, std::nullopt, 0.0);
    if (refused_ > refused && norm(refused_at_m_ - there.position_m) < 1e-3) ++refused_there_;
  }
  int refused_there_{};
};

TEST_P(RatesThroughWrist, KeepEveryLimitAtEveryTick) {
  for (const double miss_m : {0.0, 1e-9, 3e-8}) {
    SCOPED_TRACE(miss_m);
    planned_ = refused_there_ = 0;
    for (int i = 0; i < 60; ++i) {
      SCOPED_TRACE(i);
      ASSERT_NO_FATAL_FAILURE(check_line(miss_m));
    }
    EXPECT_GT(planned_, 20);
    EXPECT_LE(refused_there_, planned_ / 5);
  }
  EXPECT_LE(std::max(all_.greatest(), tool_.greatest()), kWithin);
}

INSTANTIATE_TEST_SUITE_P(Arms, RatesThroughWrist, testing::Values("puma560"),
                         [](const auto& arm) { return std::string(arm.param); });

}  // namespace
}  // namespace corbot::property_rates_test
