// SPDX-License-Identifier: Apache-2.0
// Random motions of all kinds of arm keep every limit of every joint and of the tool, tick by tick.
#include <gtest/gtest.h>

#include <algorithm>
#include <numbers>
#include <random>
#include <string>

#include "inverse_at_pitch.h"
#include "limit_ticks.h"
#include "path_ticks.h"
#include "planner/planner.h"
#include "planner/time_law_planner.h"
#include "random_settings.h"
#include "support/gate.h"
#include "support/test_arms.h"

namespace corbot::property_limits_test {
namespace {

using test::LimitShares;
using test::random_settings;
using test::tick_shares;
using test::TickShares;

constexpr double kWithin = 1.000'01;
constexpr int kCases = 160;

class Limits : public testing::TestWithParam<const char*> {
 protected:
  double in(double low, double high) { return std::uniform_real_distribution<double>(low, high)(random_); }
  Joints joints() {
    Joints q{};
    for (std::size_t i = 0; i < arm_.dof; ++i) q[i] = in(arm_.joints[i].lower_q, arm_.joints[i].upper_q);
    return q;
  }
  Vector3 near(const Vector3& p, double size) {
    return {p[0] + in(-size, size), p[1] + in(-size, size), p[2] + in(-size, size)};
  }
  /// Every fourth case starts with all joints at 0, where most arms are stretched.
  PlanStart start(int i) { return {i % 4 == 0 ? Joints{} : joints(), 0.0}; }
  PlanSettings settings(int i, const PlanStart& from) {
    return random_settings(arm_, i, from, [this](double low, double high) { return in(low, high); });
  }
  /// Greatest shares of every line or arc that was planned.
  void look(const PlanSettings& s, const PlanResult& result, TickShares& line, TickShares& arc) {
    if (!std::holds_alternative<std::vector<Command>>(result)) return;
    const auto& commands = std::get<std::vector<Command>>(result);
    for (std::size_t k = 0; k < commands.size(); ++k) {
      const PlannedRate rate = result.rates.empty() ? PlannedRate{} : result.rates[k];
      const TickShares shares = tick_shares(arm_, s, commands[k], rate);
      ASSERT_TRUE(shares.is_reachable);
      TickShares& all = commands[k].kind == MotionKind::kArc ? arc : line;
      for (std::size_t i = 0; i < arm_.dof; ++i) all.joints[i].take(shares.joints[i]);
      all.tool.take(shares.tool);
      all.turning.take(shares.turning);
      ++planned_;
    }
  }
  static void expect_within(const TickShares& found, const char* kind) {
    EXPECT_LE(found.joint().greatest(), kWithin) << kind;
    EXPECT_LE(found.tool.greatest(), kWithin) << kind;
    EXPECT_LE(found.turning.greatest(), kWithin) << kind;
  }

  ArmModel arm_ = test::arm_of(GetParam());
  std::mt19937_64 random_{1751};
  int planned_{};
};

TEST_P(Limits, AreKeptByJointMotions) {
  LimitShares all;
  for (int i = 0; i < kCases; ++i) {
    const PlanStart from = start(i);
    const PlanSettings s = settings(i, from);
    const PlanResult result = Planner(arm_).move_joints(from, s, joints(), i % 4 == 1 ? in(0.0, 4.0) : 0.0);
    ASSERT_TRUE(std::holds_alternative<std::vector<Command>>(result)) << std::get<PlanRefusal>(result).text;
    all.take(tick_shares(arm_, s, std::get<std::vector<Command>>(result).front()).joint());
  }
  EXPECT_LE(all.greatest(), kWithin);
  EXPECT_GT(std::min({all.speed, all.acceleration, all.jerk}), 0.99) << "they reach their limits";
}

TEST_P(Limits, AreKeptByLinesAndArcs) {
  TickShares line, arc;
  if (!test::has_paths(arm_)) GTEST_SKIP() << "no lines and arcs";
  for (int i = 0; i < kCases; ++i) {
    const PlanStart from = start(i);
    const PlanSettings s = settings(i, from);
    const Vector3 here = arm_.kinematics.forward(from.position_q).position_m;
    const double size = i % 8 < 4 ? 0.1 : 0.02;
    const Vector3 p2 = near(here, size), p3 = near(here, size);
    ASSERT_NO_FATAL_FAILURE(look(s, Planner(arm_).move_s(from, s, p2, 0.0), line, arc)) << "case " << i;
    ASSERT_NO_FATAL_FAILURE(look(s, Planner(arm_).move_c(from, s, here, p2, p3), line, arc)) << "case " << i;
  }
  EXPECT_GT(planned_, kCases / 4);
  expect_within(line, "lines");
  expect_within(arc, "arcs");
}

/// The base is free there, and stays where it is.
TEST(LimitsAlongASingularity, AreKeptAndTheTaskTakesTheLine) {
  ArmModel arm = test::arm_of("lynx5");
  for (std::size_t i = 0; i < arm.dof; ++i) {
    arm.joints[i].lower_q = -std::numbers::pi;
    arm.joints[i].upper_q = std::numbers::pi;
  }
  PlanSettings up;
  up.tool_pitch_rad = 0.5 * std::numbers::pi;
  const IkSolution low = test::inverse_at_pitch(arm.kinematics, {0.0, 0.0, 0.3}, *up.tool_pitch_rad, 0, {});
  ASSERT_EQ(low.status, IkStatus::kOk);
  const PlanResult result = Planner(arm).move_s({low.joints_q, 0.0}, up, {0.0, 0.0, 0.34}, 0.0);
  ASSERT_TRUE(std::holds_alternative<std::vector<Command>>(result)) << std::get<PlanRefusal>(result).text;
  const Command& line = std::get<std::vector<Command>>(result).front();
  const PlannedRate rate = test::rate_of(result);
  ASSERT_FALSE(rate.pieces.empty()) << "it has a rate";
  EXPECT_EQ(test::gate(arm, line, rate), Verdict::kDone);
  const TickShares shares = tick_shares(arm, up, line, rate);
  EXPECT_LE(shares.joint().greatest(), kWithin);
  EXPECT_LE(shares.tool.greatest(), kWithin);
  EXPECT_GE(std::max(shares.joint().greatest(), shares.tool.greatest()), 0.9)
      << "it is as quick as it may be";
}

/// The checker itself: a motion that is run faster by 1 % is beyond its limits by the powers of that.
TEST(LimitTicks, FindsWhatIsRunTooFast) {
  const ArmModel arm = test::arm_of("cartesian_ppp");
  const auto command = [](const PlanResult& result) {
    return std::get<std::vector<Command>>(result).front();
  };
  Command joints = command(Planner(arm).move_joints({}, {}, {0.3}, 0.0));
  joints.duration_s /= 1.01;
  for (std::size_t i = 0; i < arm.dof; ++i) {
    joints.joint.law[i] = stretch(joints.joint.law[i], joints.duration_s);
  }
  const LimitShares share = tick_shares(arm, {}, joints).joint();
  EXPECT_NEAR(share.speed, 1.01, 1e-6);
  EXPECT_NEAR(share.acceleration, 1.01 * 1.01, 1e-6);
  EXPECT_NEAR(share.jerk, 1.01 * 1.01 * 1.01, 1e-4);

  const Vector3 here = arm.kinematics.forward({}).position_m;
  const PlanResult planned = Planner(arm).move_s({}, {}, here - Vector3{0.1, 0.0, 0.0}, 0.0);
  Command line = command(planned);
  PlannedRate rate = test::rate_of(planned);
  const LimitShares good = tick_shares(arm, {}, line, rate).tool;
  line.duration_s /= 1.01;
  for (rate::Piece& piece : rate.pieces) {
    piece.begin_s /= 1.01;
    piece.begin.v *= 1.01;
    piece.begin.a *= 1.01 * 1.01;
    piece.begin.j *= 1.01 * 1.01 * 1.01;
  }
  const LimitShares tool = tick_shares(arm, {}, line, rate).tool;
  EXPECT_NEAR(tool.speed, 1.01 * good.speed, 1e-5);
  EXPECT_NEAR(tool.acceleration, 1.01 * 1.01 * good.acceleration, 1e-2);
  EXPECT_NEAR(tool.jerk, 1.01 * 1.01 * 1.01 * good.jerk, 1e-1);
}

INSTANTIATE_TEST_SUITE_P(Arms, Limits, testing::ValuesIn(test::kTestArms),
                         [](const auto& arm) { return std::string(arm.param); });

}  // namespace
}  // namespace corbot::property_limits_test
