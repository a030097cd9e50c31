// SPDX-License-Identifier: Apache-2.0
// The quickest rate along a path: as quick as a law that is known to be, near its limits everywhere, and
// quick past an axis.
#include "planner/rate/optimum.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <random>
#include <string>

#include "corbot/kinematics/tool_pose.h"
#include "corbot/motion/path_joints.h"
#include "planner/planner.h"
#include "planner/time_law_planner.h"
#include "support/test_arms.h"

namespace corbot::unit_rate_optimum_test {
namespace {

using rate::Knot;
using rate::Limits;
using rate::Ramp;
using rate::RateLaw;

struct Planned {
  double duration_s{};  ///< on the grid
  double factor{};      ///< of the stretch that makes it keep all limits
  double stretched_s() const { return duration_s * factor; }
};

template <class Motion>
Planned planned(const ArmModel& arm, const Motion& motion, const Joints& start_q) {
  const Limits limits = rate::limits_of(arm, {}, motion);
  const auto knots = std::get<std::vector<Knot>>(rate::plan_geometry(arm, motion, start_q, limits.speed));
  rate::Optimum optimum(rate::Grid(knots, limits));
  optimum.run(2e-3);
  RateLaw law = optimum.law();
  const rate::Proof proof = prove(law, knots, limits);
  EXPECT_TRUE(proof.is_forward);
  const Planned result{law.duration_s(), proof.factor};
  law.stretch(proof.factor);
  EXPECT_LE(prove(law, knots, limits).factor, 1.0 + 1e-9);
  return result;
}

TEST(RateOptimum, IsAsQuickAsTheQuickestLawOfOneJoint) {
  const ArmModel arm = test::arm_of("cartesian_ppp");
  for (const double length_m : {0.3, 0.03, 1e-3, 1e-5}) {
    LineMotion line{};
    line.from_m = arm.kinematics.forward({}).position_m;
    line.to_m = line.from_m - Vector3{length_m, 0.0, 0.0};
    line.tool.from = {1.0, 0.0, 0.0, 0.0};
    const TimeLaw law =
        plan_law(length_m, {arm.path.speed_m_s, arm.path.acceleration_m_s2, arm.path.jerk_m_s3});
    const Planned rate = planned(arm, line, {});
    EXPECT_LT(rate.stretched_s(), 1.03 * law.duration_s()) << length_m;
    EXPECT_GE(rate.stretched_s(), law.duration_s() * (1.0 - 1e-9)) << length_m;
  }
}

TEST(RateOptimum, PassesTheBaseAxisQuickly) {
  const ArmModel arm = test::arm_of("lynx5");
  for (const double miss_m : {0.03, 0.01, 0.003}) {
    LineMotion line{};
    line.from_m = {miss_m, -0.1, 0.12};
    line.to_m = {miss_m, 0.1, 0.12};
    line.tool.from = {1.0, 0.0, 0.0, 0.0};
    line.tool.from_angles_rad = line.tool.to_angles_rad = {-1.4, 0.0};
    const IkSolution ik = joints_at(arm, point_at(line, 0.0), line.solution, {});
    ASSERT_EQ(ik.status, IkStatus::kOk);
    const Planned rate = planned(arm, line, ik.joints_q);
    EXPECT_LT(rate.stretched_s(), 2.3) << miss_m;
  }
}

class RateOptimumOf : public testing::TestWithParam<const char*> {};

TEST_P(RateOptimumOf, RandomPathsNeedLittleStretch) {
  const ArmModel arm = test::arm_of(GetParam());
  std::mt19937_64 random(1751);
  const auto in = [&](double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(random);
  };
  std::vector<double> factors;
  for (int i = 0; i < 60; ++i) {
    PlanStart from;
    for (std::size_t k = 0; k < arm.dof; ++k)
      from.position_q[k] = in(arm.joints[k].lower_q, arm.joints[k].upper_q);
    const Pose here = arm.kinematics.forward(from.position_q);
    PlanSettings s;
    if (arm.kinematics.follows() == Follows::kPitch)
      s.tool_pitch_rad = tool_pose(arm.kinematics, from.position_q).pitch_rad;
    const auto near = [&] { return here.position_m + Vector3{in(-0.1, 0.1), in(-0.1, 0.1), in(-0.1, 0.1)}; };
    const Vector3 p2 = near(), p3 = near();
    const PlanResult result = i % 4 < 2 ? Planner(arm).move_s(from, s, p2, 0.0)
                                        : Planner(arm).move_c(from, s, here.position_m, p2, p3);
    if (std::holds_alternative<PlanRefusal>(result)) continue;
    const Command& command = std::get<std::vector<Command>>(result).front();
    SCOPED_TRACE(i);
    const Planned rate = command.kind == MotionKind::kLine ? planned(arm, command.line, command.start_q)
                                                           : planned(arm, command.arc, command.start_q);
    factors.push_back(rate.factor);
  }
  std::sort(factors.begin(), factors.end());
  ASSERT_GT(factors.size(), 8U);
  EXPECT_LT(factors[factors.size() / 2], 1.02);
  EXPECT_LT(factors.back(), 1.1);
}

INSTANTIATE_TEST_SUITE_P(Arms, RateOptimumOf,
                         testing::Values("lynx5", "puma560", "scara_gx4", "cartesian_ppp"),
                         [](const auto& arm) { return std::string(arm.param); });

TEST(RateRamp, IsSmoothAndInvertible) {
  for (const double ramp_s : {0.1, 5.0}) {
    const Ramp ramp(0.7, ramp_s);
    EXPECT_NEAR(ramp.at(ramp.length_mu())[0], 0.7, 1e-15);
    EXPECT_EQ(ramp.at(0.0)[1], 0.0);
    constexpr double kStep = 1e-5;
    for (int k = 1; k < 50; ++k) {
      const double mu = ramp.length_mu() * (k + 0.1) / 50.0;
      const auto g = ramp.at(mu), a = ramp.at(mu - kStep), b = ramp.at(mu + kStep);
      for (std::size_t n = 1; n < g.size(); ++n)
        EXPECT_NEAR(g[n], (b[n - 1] - a[n - 1]) / (2.0 * kStep), 1e-3 + 1e-6 * std::abs(g[n])) << mu;
      EXPECT_NEAR(ramp.at(ramp.mu_at(g[0]))[0], g[0], 1e-11);
    }
  }
}

}  // namespace
}  // namespace corbot::unit_rate_optimum_test
