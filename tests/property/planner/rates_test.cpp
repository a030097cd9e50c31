// SPDX-License-Identifier: Apache-2.0
// Random lines and arcs of all kinds of arm at their limits: every limit of every joint and of the tool at every tick, the tool on its
// path, and exact ends. Singular starts are among them, and lines through a singular wrist.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <string>
#include <variant>

#include "corbot/kinematics/tool_pose.h"
#include "corbot/motion/path.h"
#include "corbot/motion/path_joints.h"
#include "corbot/units.h"
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

  ArmModel arm_ = test::arm_of(GetParam());
  std::mt19937_64 random_{test::seed() + 11};
  test::LimitShares all_, tool_;
  int planned_{}, refused_{};
  Vector3 refused_at_m_{};  ///< the last one
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
  /// A line that leads at this distance past a place where axes 4 and 6 are in one line. Some leave the reach elsewhere. Some come near such
  /// a place once more.
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
