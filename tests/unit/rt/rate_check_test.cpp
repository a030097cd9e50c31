// SPDX-License-Identifier: Apache-2.0
// Every look of RateCheck by itself: knots that all the others would let pass.
#include "rt/cycle/rate_check.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <stdexcept>
#include <variant>
#include <vector>

#include "../../support/test_arms.h"
#include "corbot/motion/path.h"
#include "planner/planner.h"
#include "planner/rate/grid.h"
#include "planner/rate/optimum.h"
#include "planner/rate/rate_planner.h"

namespace corbot::test::rate_check_test {
namespace {

const ArmModel& xarm6() {
  static const ArmModel arm = arm_of("xarm6");
  return arm;
}
/// Four joints, of which it follows one angle.
ArmModel other_lynx5() {
  ArmModel arm = arm_of("lynx5");
  arm.kinematics = Kinematics::other(arm.kinematics.chain());
  return arm;
}
const Joints kLynxBent{0.1, 0.9, 1.2, 0.4};

struct RatedLine {
  Command command{};
  std::vector<rate::Knot> knots{};
  std::vector<rate::Piece> pieces{};
};

RatedLine planned(const ArmModel& arm, const Joints& from = {}) {
  const Vector3 target_m = arm.kinematics.forward(from).position_m + Vector3{0.01, 0.05, -0.02};
  const PlanResult plan = Planner(arm).move_s({from, 0.0}, {}, target_m, 0.0);
  if (const auto* refusal = std::get_if<PlanRefusal>(&plan)) throw std::runtime_error(refusal->text);
  return {std::get<std::vector<Command>>(plan).front(), plan.rates.front().knots, plan.rates.front().pieces};
}

/// With a rate of its own.
RatedLine timed(const ArmModel& arm, RatedLine path) {
  const rate::Limits limits = rate::reserved(rate::limits_of(arm, path.command.line));
  rate::Optimum optimum(rate::Grid(path.knots, limits));
  optimum.run(1e-2);
  rate::RateLaw law = optimum.law();
  law.stretch(prove(law, path.knots, limits).factor * 1.001);
  path.pieces = law.pieces();
  path.command.duration_s = law.duration_s();
  return path;
}

/// A path of its first cell alone.
RatedLine first_cell(const ArmModel& arm, RatedLine path) {
  path.knots.resize(2);
  rate::Knot& last = path.knots[1];
  const double part = last.z[rate::kPath];
  path.command.line.to_m = point_at(path.command.line, part).position_m;
  std::copy_n(last.z.begin(), kMaxJoints, path.command.end_q.begin());
  for (rate::Knot& knot : path.knots) {
    for (rate::State* const state : {&knot.z, &knot.rate, &knot.bend}) (*state)[rate::kPath] /= part;
  }
  last.z[rate::kPath] = 1.0;
  return timed(arm, path);
}

rt::CommandVerdict verdict(const ArmModel& arm, const RatedLine& path) {
  rt::RateCheck check;
  Command command = path.command;
  command.id = 1;
  const rate::RatePath sent{path.knots, {path.pieces, path.command.duration_s, path.knots.back().lambda_s}};
  for (std::size_t i = 0; i <= kMostKnots + rate::kMostPieces; ++i) {
    if (const auto verdict = check.step(arm, command, sent)) return *verdict;
  }
  ADD_FAILURE() << "no end";
  return {};
}
Verdict kind(const ArmModel& arm, const RatedLine& path) { return verdict(arm, path).verdict; }

TEST(RateCheck, TakesWhatIsPlanned) {
  EXPECT_EQ(kind(xarm6(), planned(xarm6())), Verdict::kDone);
  EXPECT_EQ(kind(xarm6(), first_cell(xarm6(), planned(xarm6()))), Verdict::kDone);
  EXPECT_EQ(kind(other_lynx5(), planned(other_lynx5(), kLynxBent)), Verdict::kDone);
}

TEST(RateCheck, RefusesALineBesideThePath) {
  RatedLine path = planned(xarm6());
  path.command.line.from_m[2] += 1e-5;
  path.command.line.to_m[2] += 1e-5;
  EXPECT_EQ(kind(xarm6(), path), Verdict::kMalformed);
}

TEST(RateCheck, RefusesAnotherFollowedAngle) {
  RatedLine path = planned(other_lynx5(), kLynxBent);
  path.command.line.tool.from_angles_rad[0] += 1e-5;
  path.command.line.tool.to_angles_rad[0] += 1e-5;
  EXPECT_EQ(kind(other_lynx5(), path), Verdict::kMalformed);
}

/// A polynomial that is 0 at all four points that are looked at: only its slopes give it away.
TEST(RateCheck, RefusesAWayRoundThePointsBetweenKnots) {
  constexpr double kOff = 1e-3;
  RatedLine both = first_cell(xarm6(), planned(xarm6()));
  const rate::Cell good(both.knots[0], both.knots[1]);
  const double h = good.length_s();
  // t (t − 1/4) (t − 3/4) (t − 1)
  both.knots[0].rate[2] -= 0.1875 * kOff / h;
  both.knots[1].rate[2] += 0.1875 * kOff / h;
  both.knots[0].bend[2] += 2.375 * kOff / (h * h);
  both.knots[1].bend[2] += 2.375 * kOff / (h * h);
  const rate::Cell forged(both.knots[0], both.knots[1]);
  for (const double t : {0.0, 0.25, 0.75, 1.0}) ASSERT_NEAR(forged.at(t)[2], good.at(t)[2], 1e-15);
  ASSERT_GT(std::abs(forged.at(0.5)[2] - good.at(0.5)[2]), 1e-5);
  EXPECT_EQ(kind(xarm6(), both), Verdict::kMalformed);

  // t (t − 1/4) (t − 3/4) (t − 1)²: the last knot's slope is right.
  RatedLine first = first_cell(xarm6(), planned(xarm6()));
  first.knots[0].rate[2] += 0.1875 * kOff / h;
  first.knots[0].bend[2] -= 2.75 * kOff / (h * h);
  first.knots[1].bend[2] += 0.375 * kOff / (h * h);
  const rate::Cell begun(first.knots[0], first.knots[1]);
  for (const double t : {0.0, 0.25, 0.75, 1.0}) ASSERT_NEAR(begun.at(t)[2], good.at(t)[2], 1e-15);
  EXPECT_EQ(kind(xarm6(), first), Verdict::kMalformed);
}

TEST(RateCheck, RefusesAKnotThatIsThereTwice) {
  RatedLine path = planned(xarm6());
  path.knots.insert(path.knots.begin() + 1, path.knots[1]);
  EXPECT_EQ(kind(xarm6(), path), Verdict::kMalformed);
}

TEST(RateCheck, RefusesAHairBeforeTheFirstKnotOrAfterTheLast) {
  RatedLine late = planned(xarm6());
  late.knots.front().z[rate::kPath] = 1e-9;
  EXPECT_EQ(kind(xarm6(), late), Verdict::kMalformed);
  RatedLine early = planned(xarm6());
  early.knots.back().z[rate::kPath] = 1.0 - 1e-9;
  EXPECT_EQ(kind(xarm6(), early), Verdict::kMalformed);
}

/// About the axis of the last joint a single piece is exact, however long it is.
TEST(RateCheck, RefusesAPieceOnWhichAJointGoesFar) {
  const auto turn = [](double angle_rad) {
    RatedLine path;
    const Pose here = xarm6().kinematics.forward({});
    LineMotion& line = path.command.line;
    path.command.kind = MotionKind::kLine;
    line.from_m = line.to_m = here.position_m;
    line.tool.from = here.orientation;
    line.tool.turn_rad = rotate(here.orientation, {0.0, 0.0, angle_rad});
    rate::Knot first{}, last{};
    last.lambda_s = 1.0;
    last.z[5] = first.rate[5] = last.rate[5] = angle_rad;
    last.z[rate::kPath] = first.rate[rate::kPath] = last.rate[rate::kPath] = 1.0;
    path.command.end_q[5] = angle_rad;
    path.knots = {first, last};
    return timed(xarm6(), path);
  };
  EXPECT_EQ(kind(xarm6(), turn(0.4)), Verdict::kDone);
  EXPECT_EQ(kind(xarm6(), turn(1.0)), Verdict::kMalformed);
}

TEST(RateCheck, RefusesAPathThatBeginsWhereTheArmDoesNotRest) {
  RatedLine path = planned(xarm6());
  path.command.start_q[1] += 1e-3;
  const rt::CommandVerdict refused = verdict(xarm6(), path);
  EXPECT_EQ(refused.verdict, Verdict::kDiscontinuous);
  EXPECT_EQ(refused.joint, 1);
}

TEST(RateCheck, RefusesJointsThatTheArmHasNot) {
  RatedLine path = planned(other_lynx5(), kLynxBent);
  for (rate::Knot& knot : path.knots) knot.z[4] = 1e-7;
  path.command.start_q[4] = path.command.end_q[4] = 1e-7;
  const rt::CommandVerdict refused = verdict(other_lynx5(), path);
  EXPECT_EQ(refused.verdict, Verdict::kMalformed);
  EXPECT_EQ(refused.joint, 4);
}

TEST(RateCheck, RefusesAWayBeyondAJointsRange) {
  const RatedLine path = planned(xarm6());
  int narrowed = 0;
  for (std::size_t i = 0; i < 6; ++i) {
    const double middle_q = path.knots[path.knots.size() / 2].z[i];
    if (std::abs(middle_q) < 1e-3) continue;
    ArmModel narrow = xarm6();
    (middle_q > 0.0 ? narrow.joints[i].upper_q : narrow.joints[i].lower_q) = 0.5 * middle_q;
    EXPECT_EQ(kind(narrow, path), Verdict::kLimit) << i;
    ++narrowed;
  }
  EXPECT_GE(narrowed, 3);
}

}  // namespace
}  // namespace corbot::test::rate_check_test
