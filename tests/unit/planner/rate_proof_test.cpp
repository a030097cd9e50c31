// SPDX-License-Identifier: Apache-2.0
// The proof of a rate along a path against differences of its set-points, taken closer together than anything
// that moves.
#include "planner/rate/proof.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <random>
#include <string>

#include "corbot/motion/law_evaluation.h"
#include "corbot/motion/path.h"
#include "planner/planner.h"
#include "planner/time_law_planner.h"
#include "support/test_arms.h"

namespace corbot::unit_rate_proof_test {
namespace {

using rate::Cell;
using rate::Knot;
using rate::kPath;
using rate::Limits;
using rate::RateLaw;
using rate::Shares;
using rate::State;

/// z at a time; `cell`: where it was last, going forward.
State state_at(const RateLaw& law, const std::vector<Knot>& knots, double t_s, std::size_t& cell) {
  const double lambda_s = law.at(t_s).lambda_s;
  while (cell + 2 < knots.size() && lambda_s > knots[cell + 1].lambda_s) ++cell;
  const Cell c(knots[cell], knots[cell + 1]);
  return c.at((lambda_s - knots[cell].lambda_s) / c.length_s());
}

/// Greatest shares of the limits, by differences over a ten-thousandth of the whole: of joints, of the tool's
/// travel and of its turn.
template <class Motion>
Shares scanned(const ArmModel& arm, const Motion& motion, const RateLaw& law,
               const std::vector<Knot>& knots) {
  constexpr int kSteps = 10'000;
  const double dt = law.duration_s() / kSteps;
  Shares most;
  const auto look = [&](const std::array<Vector3, 4>& x, double v, double a, double j) {
    most.speed = std::max(most.speed, norm(x[0] - x[1]) / (dt * v));
    most.acceleration = std::max(most.acceleration, norm(x[0] - 2.0 * x[1] + x[2]) / (dt * dt * a));
    most.jerk = std::max(most.jerk, norm(x[0] - 3.0 * x[1] + 3.0 * x[2] - x[3]) / (dt * dt * dt * j));
  };
  std::array<State, 4> z{};
  z.fill(knots.front().z);
  std::size_t cell = 0;
  for (int k = 0; k <= kSteps; ++k) {
    std::rotate(z.begin(), z.end() - 1, z.end());
    z[0] = state_at(law, knots, k * dt, cell);
    std::array<Vector3, 4> x{};
    for (std::size_t i = 0; i < arm.dof; ++i) {
      for (std::size_t n = 0; n < 4; ++n) x[n] = {z[n][i], 0.0, 0.0};
      look(x, arm.joints[i].speed_q_s, arm.joints[i].acceleration_q_s2, arm.joints[i].jerk_q_s3);
    }
    for (std::size_t n = 0; n < 4; ++n) x[n] = point_at(motion, z[n][kPath]).position_m;
    look(x, arm.path.speed_m_s, arm.path.acceleration_m_s2, arm.path.jerk_m_s3);
    for (std::size_t n = 0; n < 4; ++n) x[n] = {z[n][kPath] * rotation_rad(motion.tool), 0.0, 0.0};
    look(x, arm.path.rotation_speed_rad_s, arm.path.rotation_acceleration_rad_s2,
         arm.path.rotation_jerk_rad_s3);
  }
  return most;
}

/// From rest to rest over the curve, slow at both ends, in 64 steps.
RateLaw law_along(double length_s) {
  const TimeLaw shape = plan_law(length_s, {0.8, 6.0, 60.0});
  std::vector<double> lambda_s, steps_s(64, shape.duration_s() / 64.0);
  for (std::size_t k = 0; k <= steps_s.size(); ++k)
    lambda_s.push_back(evaluate(shape, static_cast<double>(k) * steps_s.front()).position);
  return {lambda_s, steps_s};
}

class RateProof : public testing::TestWithParam<const char*> {
 protected:
  double in(double low, double high) { return std::uniform_real_distribution<double>(low, high)(random_); }

  template <class Motion>
  void check(const Motion& motion, const Joints& start_q) {
    const Limits limits = rate::limits_of(arm_, {}, motion);
    const rate::KnotList list = rate::plan_geometry(arm_, motion, start_q, limits.speed);
    ASSERT_TRUE(std::holds_alternative<std::vector<Knot>>(list));
    const auto& knots = std::get<std::vector<Knot>>(list);
    RateLaw law = law_along(knots.back().lambda_s);
    const rate::Proof proof = prove(law, knots, limits);
    ASSERT_TRUE(proof.is_forward);
    ASSERT_EQ(proof.pieces.size(), law.pieces().size());
    const Shares bound = std::accumulate(proof.pieces.begin(), proof.pieces.end(), Shares{}, rate::greater);
    const Shares seen = scanned(arm_, motion, law, knots);
    // The tool, which follows within 1e-8 m, and the rounding of differences.
    EXPECT_LE(seen.speed, bound.speed * (1.0 + 1e-6) + 1e-6);
    EXPECT_LE(seen.acceleration, bound.acceleration * (1.0 + 1e-6) + 1e-5);
    EXPECT_LE(seen.jerk, bound.jerk * (1.0 + 1e-6) + 1e-3);
    excess_ = std::max(
        {excess_, bound.speed / seen.speed, bound.acceleration / seen.acceleration, bound.jerk / seen.jerk});
    // Stretched by what it says, the law is at a limit and beyond none.
    law.stretch(proof.factor);
    const rate::Proof again = prove(law, knots, limits);
    EXPECT_NEAR(again.factor, 1.0, 1e-9);
    const Shares kept = scanned(arm_, motion, law, knots);
    EXPECT_LE(std::max({kept.speed, kept.acceleration, kept.jerk}), 1.0 + 1e-3);
    ++checked_;
  }

  ArmModel arm_ = test::arm_of(GetParam());
  std::mt19937_64 random_{1751};
  double excess_{};
  int checked_{};
};

TEST_P(RateProof, BoundsWhatAScanSees) {
  for (int i = 0; i < 40; ++i) {
    PlanStart from;
    for (std::size_t k = 0; k < arm_.dof; ++k)
      from.position_q[k] = in(arm_.joints[k].lower_q, arm_.joints[k].upper_q);
    const Pose here = arm_.kinematics.forward(from.position_q);
    PlanSettings s;
    if (arm_.kinematics.follows() == Follows::kPitch)
      s.tool_pitch_rad = std::asin(std::clamp(rotate(here.orientation, {1.0, 0.0, 0.0})[2], -1.0, 1.0));
    if (arm_.kinematics.follows() == Follows::kFull && i % 2 == 1)
      s.tool_orientation = about({0.6, 0.0, 0.8}, 0.5) * here.orientation;
    const auto near = [&] { return here.position_m + Vector3{in(-0.1, 0.1), in(-0.1, 0.1), in(-0.1, 0.1)}; };
    const Vector3 p2 = near(), p3 = near();
    const PlanResult result = i % 4 < 2 ? Planner(arm_).move_s(from, s, p2, 0.0)
                                        : Planner(arm_).move_c(from, s, here.position_m, p2, p3);
    if (std::holds_alternative<PlanRefusal>(result)) continue;
    const Command& command = std::get<std::vector<Command>>(result).front();
    SCOPED_TRACE(i);
    if (command.kind == MotionKind::kLine) check(command.line, command.start_q);
    if (command.kind == MotionKind::kArc) check(command.arc, command.start_q);
  }
  EXPECT_GT(checked_, 6);
  EXPECT_LT(excess_, 1.15);  // bounds are near to what is reached, though jerk jumps within these pieces
}

INSTANTIATE_TEST_SUITE_P(Arms, RateProof, testing::Values("lynx5", "puma560", "scara_gx4", "cartesian_ppp"),
                         [](const auto& arm) { return std::string(arm.param); });

TEST(RateProofRefused, IsALawThatGoesBack) {
  const ArmModel arm = test::arm_of("cartesian_ppp");
  LineMotion line{};
  line.from_m = arm.kinematics.forward({}).position_m;
  line.to_m = line.from_m - Vector3{0.1, 0.0, 0.0};
  line.tool.from = {1.0, 0.0, 0.0, 0.0};
  const Limits limits = rate::limits_of(arm, {}, line);
  const auto knots = std::get<std::vector<Knot>>(rate::plan_geometry(arm, line, {}, limits.speed));
  const double length_s = knots.back().lambda_s;
  const std::array<double, 5> steps_s{0.2, 0.2, 0.2, 0.2, 0.2};
  const std::array<double, 6> there{0.0, 0.0, 0.4 * length_s, 0.6 * length_s, 0.0, length_s};
  const std::array<double, 6> back{0.0, 0.0, 0.9 * length_s, 0.2 * length_s, 0.0, length_s};
  EXPECT_TRUE(prove(RateLaw(there, steps_s), knots, limits).is_forward);
  EXPECT_FALSE(prove(RateLaw(back, steps_s), knots, limits).is_forward);
}

}  // namespace
}  // namespace corbot::unit_rate_proof_test
