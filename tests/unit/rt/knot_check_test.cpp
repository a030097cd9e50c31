// SPDX-License-Identifier: Apache-2.0
// Every look of KnotCheck by itself: knots that all the others would let pass.
#include "rt/cycle/knot_check.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstddef>
#include <stdexcept>
#include <variant>
#include <vector>

#include "../../support/test_arms.h"
#include "corbot/motion/path.h"
#include "planner/planner.h"

namespace corbot::test::knot_check_test {
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

struct KnottedLine {
  Command command{};
  std::vector<PathKnot> knots{};
};

KnottedLine planned(const ArmModel& arm, const Joints& from = {}) {
  const Vector3 target_m = arm.kinematics.forward(from).position_m + Vector3{0.01, 0.05, -0.02};
  const PlanResult plan = Planner(arm, PathTiming::kLaw).move_s({from, 0.0}, {}, target_m, 0.0);
  if (const auto* refusal = std::get_if<PlanRefusal>(&plan)) throw std::runtime_error(refusal->text);
  return {std::get<std::vector<Command>>(plan).front(), plan.knots.front()};
}

/// A path of its first piece alone.
KnottedLine first_piece(KnottedLine path) {
  const double part = path.knots[1].s;
  path.command.line.to_m = point_at(path.command.line, part).position_m;
  path.command.end_q = path.knots[1].q;
  path.knots.resize(2);
  path.knots[1].s = 1.0;
  for (PathKnot& knot : path.knots) {
    for (std::size_t i = 0; i < kMaxJoints; ++i) {
      knot.rate_q[i] *= part;
      knot.bend_q[i] *= part * part;
    }
  }
  return path;
}

rt::CommandVerdict verdict(const ArmModel& arm, const KnottedLine& path) {
  rt::KnotCheck check;
  for (std::size_t i = 0; i <= kMostKnots; ++i) {
    if (const auto verdict = check.step(arm, path.command, path.knots)) return *verdict;
  }
  ADD_FAILURE() << "no end";
  return {};
}
Verdict kind(const ArmModel& arm, const KnottedLine& path) { return verdict(arm, path).verdict; }

TEST(KnotCheck, TakesWhatIsPlanned) {
  EXPECT_EQ(kind(xarm6(), planned(xarm6())), Verdict::kDone);
  EXPECT_EQ(kind(xarm6(), first_piece(planned(xarm6()))), Verdict::kDone);
  EXPECT_EQ(kind(other_lynx5(), planned(other_lynx5(), kLynxBent)), Verdict::kDone);
}

TEST(KnotCheck, RefusesALineBesideThePath) {
  KnottedLine path = planned(xarm6());
  path.command.line.from_m[2] += 1e-5;
  path.command.line.to_m[2] += 1e-5;
  EXPECT_EQ(kind(xarm6(), path), Verdict::kMalformed);
}

TEST(KnotCheck, RefusesAnotherFollowedAngle) {
  KnottedLine path = planned(other_lynx5(), kLynxBent);
  path.command.line.tool.from_angles_rad[0] += 1e-5;
  path.command.line.tool.to_angles_rad[0] += 1e-5;
  EXPECT_EQ(kind(other_lynx5(), path), Verdict::kMalformed);
}

/// A polynomial that is 0 at all four points that are looked at: only its slopes give it away.
TEST(KnotCheck, RefusesAWayRoundThePointsBetweenKnots) {
  constexpr double kOff = 1e-3;
  KnottedLine both = first_piece(planned(xarm6()));
  const KnotPiece good(both.knots[0], both.knots[1]);
  // t (t − 1/4) (t − 3/4) (t − 1)
  both.knots[0].rate_q[2] -= 0.1875 * kOff;
  both.knots[1].rate_q[2] += 0.1875 * kOff;
  both.knots[0].bend_q[2] += 2.375 * kOff;
  both.knots[1].bend_q[2] += 2.375 * kOff;
  const KnotPiece forged(both.knots[0], both.knots[1]);
  for (const double t : {0.0, 0.25, 0.75, 1.0}) ASSERT_NEAR(forged.at(t)[2], good.at(t)[2], 1e-15);
  ASSERT_GT(std::abs(forged.at(0.5)[2] - good.at(0.5)[2]), 1e-5);
  EXPECT_EQ(kind(xarm6(), both), Verdict::kMalformed);

  // t (t − 1/4) (t − 3/4) (t − 1)²: the last knot's slope is right.
  KnottedLine first = first_piece(planned(xarm6()));
  first.knots[0].rate_q[2] += 0.1875 * kOff;
  first.knots[0].bend_q[2] -= 2.75 * kOff;
  first.knots[1].bend_q[2] += 0.375 * kOff;
  const KnotPiece begun(first.knots[0], first.knots[1]);
  for (const double t : {0.0, 0.25, 0.75, 1.0}) ASSERT_NEAR(begun.at(t)[2], good.at(t)[2], 1e-15);
  EXPECT_EQ(kind(xarm6(), first), Verdict::kMalformed);
}

TEST(KnotCheck, RefusesAKnotThatIsThereTwice) {
  KnottedLine path = planned(xarm6());
  path.knots.insert(path.knots.begin() + 1, path.knots[1]);
  EXPECT_EQ(kind(xarm6(), path), Verdict::kMalformed);
}

TEST(KnotCheck, RefusesAHairBeforeTheFirstKnotOrAfterTheLast) {
  KnottedLine late = planned(xarm6());
  late.knots.front().s = 1e-9;
  EXPECT_EQ(kind(xarm6(), late), Verdict::kMalformed);
  KnottedLine early = planned(xarm6());
  early.knots.back().s = 1.0 - 1e-9;
  EXPECT_EQ(kind(xarm6(), early), Verdict::kMalformed);
}

/// About the axis of the last joint a single piece is exact, however long it is.
TEST(KnotCheck, RefusesAPieceOnWhichAJointGoesFar) {
  const auto turn = [](double angle_rad) {
    KnottedLine path;
    const Pose here = xarm6().kinematics.forward({});
    LineMotion& line = path.command.line;
    path.command.kind = MotionKind::kLine;
    line.from_m = line.to_m = here.position_m;
    line.tool.from = here.orientation;
    line.tool.turn_rad = rotate(here.orientation, {0.0, 0.0, angle_rad});
    line.law = {1.0, 1.0, 0.0, 0.0};
    PathKnot first{}, last{};
    last.s = 1.0;
    last.q[5] = first.rate_q[5] = last.rate_q[5] = angle_rad;
    path.command.end_q = last.q;
    path.knots = {first, last};
    return path;
  };
  EXPECT_EQ(kind(xarm6(), turn(0.4)), Verdict::kDone);
  EXPECT_EQ(kind(xarm6(), turn(1.0)), Verdict::kMalformed);
}

TEST(KnotCheck, RefusesAPathThatBeginsWhereTheArmDoesNotRest) {
  KnottedLine path = planned(xarm6());
  path.command.start_q[1] += 1e-3;
  const rt::CommandVerdict refused = verdict(xarm6(), path);
  EXPECT_EQ(refused.verdict, Verdict::kDiscontinuous);
  EXPECT_EQ(refused.joint, 1);
}

TEST(KnotCheck, RefusesJointsThatTheArmHasNot) {
  KnottedLine path = planned(other_lynx5(), kLynxBent);
  for (PathKnot& knot : path.knots) knot.q[4] = 1e-7;
  const rt::CommandVerdict refused = verdict(other_lynx5(), path);
  EXPECT_EQ(refused.verdict, Verdict::kMalformed);
  EXPECT_EQ(refused.joint, 4);
}

TEST(KnotCheck, RefusesAWayBeyondAJointsRange) {
  const KnottedLine path = planned(xarm6());
  int narrowed = 0;
  for (std::size_t i = 0; i < 6; ++i) {
    const double middle_q = path.knots[path.knots.size() / 2].q[i];
    if (std::abs(middle_q) < 1e-3) continue;
    ArmModel narrow = xarm6();
    (middle_q > 0.0 ? narrow.joints[i].upper_q : narrow.joints[i].lower_q) = 0.5 * middle_q;
    EXPECT_EQ(kind(narrow, path), Verdict::kLimit) << i;
    ++narrowed;
  }
  EXPECT_GE(narrowed, 3);
}

}  // namespace
}  // namespace corbot::test::knot_check_test
