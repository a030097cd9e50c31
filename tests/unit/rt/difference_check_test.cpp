// SPDX-License-Identifier: Apache-2.0
// The check of speed, acceleration and jerk at every set-point of a path: a plan passes, and a plan that was
// altered does not.
#include <gtest/gtest.h>

#include <algorithm>
#include <stdexcept>
#include <variant>
#include <vector>

#include "../../support/test_arms.h"
#include "corbot/motion/rate_knots.h"
#include "planner/planner.h"
#include "planner/rate/rate_planner.h"
#include "rt/cycle/set_point_check.h"

namespace corbot::test::difference_check_test {
namespace {

constexpr double kPeriod_s = 1e-3;

struct Curve {
  std::vector<rate::Knot> knots;
  std::vector<rate::Piece> pieces;
  double duration_s{};
};

const ArmModel& puma() {
  static const ArmModel arm = arm_of("puma560");
  return arm;
}

Curve planned() {
  const Joints from{0.3, -0.8, 0.4, 0.2, 0.3, 0.1};
  const Vector3 target_m = puma().kinematics.forward(from).position_m + Vector3{-0.1, 0.12, -0.1};
  const PlanResult plan = Planner(puma()).move_s({from, 0.0}, {}, target_m, 0.0);
  if (const auto* refusal = std::get_if<PlanRefusal>(&plan)) throw std::runtime_error(refusal->text);
  const Command& command = std::get<std::vector<Command>>(plan).front();
  const auto at_limits =
      std::get<rate::RatePlan>(rate::plan_rate(puma(), {}, command.line, command.start_q, 0.0));
  return {at_limits.knots, at_limits.law.pieces(), at_limits.law.duration_s()};
}

/// The first verdict that refuses a set-point, or the last one.
rt::SetPointVerdict verdict(const Curve& curve) {
  const auto at = [&](double t_s) {
    const rate::RatePieces law{curve.pieces, curve.duration_s, curve.knots.back().lambda_s};
    const rate::State z = rate::state_at(curve.knots, law.at(t_s).lambda_s);
    Joints q{};
    std::copy_n(z.begin(), q.size(), q.begin());
    return q;
  };
  rt::DifferenceCheck check;
  check.begin(at(0.0));
  for (int tick = 0; tick * kPeriod_s < curve.duration_s + 5 * kPeriod_s; ++tick) {
    const rt::SetPointVerdict verdict = check.see(puma(), at(tick * kPeriod_s), kPeriod_s);
    if (!verdict.ok) return verdict;
  }
  return {};
}

TEST(DifferenceCheck, TakesAPlan) { EXPECT_TRUE(verdict(planned()).ok); }

TEST(DifferenceCheck, RefusesEveryAlteredKnot) {
  const Curve good = planned();
  ASSERT_GT(good.knots.size(), 3u);
  for (std::size_t k = 1; k + 1 < good.knots.size(); ++k) {
    for (std::size_t i = 0; i < puma().dof; ++i) {
      SCOPED_TRACE(testing::Message() << "knot " << k << ", joint " << i);
      Curve place = good, rate = good, bend = good;
      place.knots[k].z[i] += 0.02;
      rate.knots[k].rate[i] += 1.0;
      bend.knots[k].bend[i] += 200.0;
      for (const Curve& bad : {place, rate, bend}) {
        const rt::SetPointVerdict found = verdict(bad);
        EXPECT_FALSE(found.ok);
        EXPECT_EQ(found.alarm.code, AlarmCode::kSetPointTooQuick);
        EXPECT_EQ(found.alarm.joint, static_cast<int>(i));
      }
    }
  }
}

TEST(DifferenceCheck, RefusesPiecesThatDoNotFit) {
  const Curve good = planned();
  for (std::size_t k = 1; k + 1 < good.pieces.size(); ++k) {
    SCOPED_TRACE(k);
    Curve place = good, speed = good;
    place.pieces[k].begin.lambda_s += 1e-3;
    speed.pieces[k].begin.v += 0.2;
    EXPECT_FALSE(verdict(place).ok);
    EXPECT_FALSE(verdict(speed).ok);
  }
}

/// Each order by itself, where the other two have room.
TEST(DifferenceCheck, NamesTheLimit) {
  for (std::size_t i = 0; i < puma().dof; ++i) {
    const JointLimits& limits = puma().joints[i];
    const auto refused_order = [&](double jerk_q_s3, double most_a_q_s2) -> std::uint32_t {
      rt::DifferenceCheck check;
      Joints q{};
      check.begin(q);
      double v = 0.0, a = 0.0;
      for (int tick = 0; tick < 100'000; ++tick) {
        a = std::min(a + jerk_q_s3 * kPeriod_s, most_a_q_s2);
        v += a * kPeriod_s;
        q[i] += v * kPeriod_s;
        const rt::SetPointVerdict found = check.see(puma(), q, kPeriod_s);
        if (!found.ok) return alarm::too_quick(found.alarm).order;
      }
      return 0;
    };
    EXPECT_EQ(refused_order(0.9 * limits.jerk_q_s3, 0.9 * limits.acceleration_q_s2), 1u);
    EXPECT_EQ(refused_order(0.9 * limits.jerk_q_s3, 1.02 * limits.acceleration_q_s2), 2u);
    EXPECT_EQ(refused_order(1.02 * limits.jerk_q_s3, 0.1 * limits.acceleration_q_s2), 3u);
  }
}

}  // namespace
}  // namespace corbot::test::difference_check_test
