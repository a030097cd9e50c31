// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <random>

#include "corbot/motion/law_evaluation.h"
#include "corbot/motion/path.h"
#include "inverse_at_pitch.h"
#include "planner/planner.h"
#include "planner/time_law_planner.h"
#include "test_arm.h"

namespace corbot::motions_test {
namespace {

using test::deg;
using test::lynx5;
using test::tcp_of;
using test::wide_arm;
using Point = std::array<double, 3>;

const PlanStart kBent{{0.1, deg(40), deg(60), deg(55), 0.0, 0.0}, 0.25};

std::vector<Command> commands_of(const PlanResult& result) {
  if (const auto* refusal = std::get_if<PlanRefusal>(&result)) {
    ADD_FAILURE() << refusal->text;
    return {Command{}};
  }
  return std::get<std::vector<Command>>(result);
}
Command only(const PlanResult& result) {
  const auto commands = commands_of(result);
  EXPECT_EQ(commands.size(), 1u);
  return commands.front();
}

TEST(Move, TakesTheTimeThatIsAskedForOrWhatTheLimitsAllow) {
  const Planner planner(lynx5());
  const Point target{0.2, -0.1, 0.1};
  const double shortest_s = only(planner.move(kBent, {}, target, 0.0)).duration_s;
  EXPECT_GT(shortest_s, 0.1);
  EXPECT_EQ(only(planner.move(kBent, {}, target, 0.5 * shortest_s)).duration_s, shortest_s);
  const Command slow = only(planner.move(kBent, {}, target, 7.25));
  EXPECT_EQ(slow.duration_s, 7.25);
  for (std::size_t i = 0; i < 4; ++i) {
    EXPECT_NEAR(slow.joint.law[i].duration_s(), 7.25, 1e-14);
    EXPECT_EQ(slow.start_q[i], kBent.position_q[i]);
  }
  EXPECT_LT(test::distance(tcp_of(lynx5(), slow.end_q), target), 1e-12);
  EXPECT_EQ(only(planner.move(kBent, {}, target, 3600.0)).duration_s, 3600.0);
}

TEST(Move, SpeedRatiosScaleTheSpeedsOfTheJoints) {
  const Planner planner(lynx5());
  const Point target{0.1, -0.2, 0.1};
  PlanSettings slow;
  slow.speed_ratio = 0.5;
  slow.joint_speed_ratio[0] = 0.2;
  const Command command = only(planner.move(kBent, slow, target, 0.0));
  EXPECT_NEAR(peaks(command.joint.law[0]).velocity, 0.1 * deg(180), 1e-9) << "the base is what takes longest";
  EXPECT_GT(command.duration_s, only(planner.move(kBent, {}, target, 0.0)).duration_s);
}

TEST(Move, KeepsThePresentSolutionWhereItCanAndElseTakesTheQuickest) {
  const ArmModel arm = lynx5();
  const Point target{0.25, 0.0, 0.1};
  const auto elbow = [&](const ArmModel& model, const Joints& start) {
    return only(Planner(model).move({start, 0.0}, {}, target, 0.0)).end_q[2];
  };
  EXPECT_GT(elbow(arm, {0, deg(40), deg(60), deg(55), 0, 0}), 0.0);
  EXPECT_LT(elbow(wide_arm(), {0, deg(10), deg(-20), deg(0), 0, 0}), 0.0);
  // θ2 < −30° is out of range here, so the solution must change.
  EXPECT_GT(elbow(arm, {0, deg(10), deg(-20), deg(0), 0, 0}), 0.0);
}

TEST(Move, KeepsThePresentSolutionEvenWhereAnotherIsQuicker) {
  const ArmModel arm = wide_arm();
  const Planner planner(arm);
  std::mt19937_64 random(5);  // fixed: what is looked for must occur
  std::uniform_real_distribution<double> unit(-1.0, 1.0);
  for (int n = 0; n < 500; ++n) {
    const PlanStart start{{unit(random), 2 * unit(random), 2 * unit(random), 2 * unit(random), 0, 0}, 0.0};
    const Point target{0.15 + 0.1 * unit(random), 0.1 * unit(random), 0.15 + 0.05 * unit(random)};
    const std::uint32_t present = arm.kinematics.solution_of(start.position_q).value_or(99);
    if (test::inverse_at_pitch(arm.kinematics, target, 0.0, present, start.position_q).status !=
        IkStatus::kOk)
      continue;
    const Command command = only(planner.move(start, {}, target, 0.0));
    ASSERT_EQ(arm.kinematics.solution_of(command.end_q), present) << n;
  }
}

TEST(Move, ConsidersWholeTurns) {
  ArmModel arm = wide_arm();
  arm.joints[0] = {deg(-20), deg(300), deg(180), deg(900), deg(8000)};
  PlanStart start = kBent;
  start.position_q[0] = deg(170);
  const IkSolution ik = test::inverse_at_pitch(arm.kinematics, {-0.2, -0.05, 0.1}, 0.0, 0, {});
  ASSERT_LT(ik.joints_q[0], deg(-20));
  const Command command = only(Planner(arm).move(start, {}, {-0.2, -0.05, 0.1}, 0.0));
  EXPECT_NEAR(command.end_q[0], ik.joints_q[0] + deg(360), 1e-12);
}

TEST(Moves, OfNoLengthAndOfAFemtometreSucceed) {
  for (const Joints& at : {kBent.position_q, Joints{}, Joints{0.3, 0.2, 0.0, 0.1, 0, 0}}) {
    const ArmModel arm = lynx5();
    const Planner planner(arm);
    const ToolPose here = tool_pose(arm.kinematics, at);
    PlanSettings settings;
    settings.tool_pitch_rad = here.pitch_rad;
    for (const double step : {0.0, -1e-300, -1e-16, -1e-15, -1e-14, -1e-12, -1e-10, -1e-8}) {
      Point target = here.position_m;
      for (double& x : target) x += step;  // inward, away from the border
      for (const double t_s : {0.0, 2.0}) {
        const Command line = only(planner.move_s({at, 0.0}, settings, target, t_s));
        EXPECT_LT(test::distance(tcp_of(arm, line.end_q), target), 1e-10) << step;
        EXPECT_GE(line.duration_s, t_s);
        EXPECT_LT(line.duration_s, t_s + 0.1) << step;
        const Command free = only(planner.move({at, 0.0}, settings, target, t_s));
        EXPECT_LT(test::distance(tcp_of(arm, free.end_q), target), 1e-12) << step;
      }
    }
    EXPECT_EQ(only(planner.move_joints({at, 0.0}, {}, at, 0.0)).duration_s, 0.0);
    EXPECT_EQ(only(planner.move_joints({at, 0.0}, {}, at, 3.0)).duration_s, 3.0);
  }
}

TEST(MoveS, RunsTheStraightLineInTheTimeAskedFor) {
  const ArmModel arm = lynx5();
  const Planner planner(arm);
  const Point target{0.2, -0.05, 0.15};
  const Command free = only(planner.move_s(kBent, {}, target, 0.0));
  EXPECT_EQ(free.kind, MotionKind::kLine);
  // Not to the bit: sine and cosine may be merged into one call in one place and not in the other.
  EXPECT_LT(test::distance(free.line.from_m, tcp_of(arm, kBent.position_q)), 1e-15);
  EXPECT_EQ(free.line.to_m, target);
  EXPECT_GT(free.line.knots.pieces, 0);
  EXPECT_NEAR(free.line.tool.to_angles_rad[0], angle_of_pitch(arm.kinematics, 0.0), 1e-15);
  EXPECT_LT(test::distance(tcp_of(arm, free.end_q), target), 1e-12);
  EXPECT_EQ(only(planner.move_s(kBent, {}, target, 0.01)).duration_s, free.duration_s);
  const Command timed = only(planner.move_s(kBent, {}, target, 12.5));
  EXPECT_EQ(timed.duration_s, 12.5);
  PlanSettings slow;
  slow.speed_ratio = 0.1;
  const PlanResult plan = planner.move_s(kBent, slow, target, 0.0);
  const double length = length_m(only(plan).line);
  double fastest = 0.0;  // of the tool
  const auto& [knots, pieces] = plan.rates.front();
  const rate::RatePieces law{pieces, only(plan).duration_s, knots.back().lambda_s};
  double before = 0.0;
  for (double t_s = 1e-3; t_s < only(plan).duration_s; t_s += 1e-3) {
    const double s = rate::state_at(knots, law.at(t_s).lambda_s)[rate::kPath];
    fastest = std::max(fastest, (s - before) * length / 1e-3);
    before = s;
  }
  EXPECT_NEAR(fastest, 0.025, 1e-4);
  EXPECT_LE(fastest, 0.025 + 1e-9);
}

/// The shoulder folds back there; the base stays where it is.
TEST(MoveS, LeadsThroughTheBaseAxis) {
  const ArmModel arm = wide_arm();
  for (const double y : {0.0, 1e-15, 1e-12}) {
    const IkSolution start = test::inverse_at_pitch(arm.kinematics, {0.1, y, 0.2}, 0.0, 0, {});
    ASSERT_EQ(start.status, IkStatus::kOk);
    for (const double x : {-0.08, -0.0371}) {
      const PlanResult plan = Planner(arm).move_s({start.joints_q, 0.0}, {}, {x, y, 0.2}, 0.0);
      const Command line = only(plan);
      ASSERT_GT(line.line.knots.pieces, 0) << y;
      const auto& knots = plan.rates.front().knots;
      for (int k = 0; k <= 100; ++k) {
        const rate::State z = rate::state_at(knots, k / 100.0 * knots.back().lambda_s);
        Joints q{};
        std::copy_n(z.begin(), q.size(), q.begin());
        EXPECT_LT(test::distance(tcp_of(arm, q), point_at(line.line, z[rate::kPath]).position_m), 1e-6) << k;
        EXPECT_NEAR(q[0], 0.0, 1e-6) << k;
      }
    }
  }
}

TEST(MoveS, BeginsAndEndsOnTheBorderOfTheWorkspace) {
  // Ready is the stretched arm: θ2 = 0, where the elbow's speed along a line is unbounded.
  const ArmModel arm = lynx5();
  const Planner planner(arm);
  const Command out = only(planner.move_s({}, {}, {0.25, 0.05, 0.1}, 0.0));
  EXPECT_EQ(out.line.solution, 0u);
  EXPECT_LT(out.duration_s, 5.0);
  PlanSettings ready_pitch;
  ready_pitch.tool_pitch_rad = deg(-35);
  const Point ready = tcp_of(arm, {});
  const Command back = only(planner.move_s({out.end_q, 0.0}, ready_pitch, ready, 0.0));
  EXPECT_LT(test::distance(tcp_of(arm, back.end_q), ready), 1e-12);
  EXPECT_LT(back.duration_s, 5.0);
}

TEST(MoveS, AtTheStretchedArmTheOtherSignIsTriedToo) {
  ArmModel arm = wide_arm();
  arm.joints[2].upper_q = deg(1e-3);  // only θ2 ≤ 0 leads anywhere
  const Command command = only(Planner(arm).move_s({}, {}, {0.25, 0.05, 0.1}, 0.0));
  EXPECT_EQ(command.line.solution, 1u);
  EXPECT_LT(command.end_q[2], 0.0);
}

TEST(MoveS, LeavesTheBaseAxisTheWayTheArmFaces) {
  const ArmModel arm = wide_arm();
  PlanSettings up;
  up.tool_pitch_rad = deg(90);
  IkSolution on_axis = test::inverse_at_pitch(arm.kinematics, {0.0, 0.0, 0.3}, deg(90), 0, {});
  ASSERT_EQ(on_axis.status, IkStatus::kOk);
  const PlanStart start{on_axis.joints_q, 0.0};
  const Planner planner(arm);
  const auto solution_at_end = [&](const Point& to_m) {
    return arm.kinematics.solution_of(only(planner.move_s(start, up, to_m, 0.0)).end_q);
  };
  EXPECT_EQ(solution_at_end({0.1, 0.0, 0.28}), 0u);
  EXPECT_EQ(solution_at_end({-0.1, 0.0, 0.28}), 2u);
  EXPECT_EQ(only(planner.move_s(start, up, {0.0, 0.0, 0.25}, 0.0)).end_q[0], 0.0) << "along the axis";
  EXPECT_TRUE(std::holds_alternative<PlanRefusal>(planner.move_s(start, up, {0.0, 0.1, 0.28}, 0.0)));
}

TEST(MoveC, GoesToP1FirstAndTravelsOverP2) {
  const ArmModel arm = lynx5();
  const Planner planner(arm);
  const Point p1{0.22, 0.0, 0.12}, p2{0.22, 0.03, 0.15}, p3{0.22, 0.0, 0.18};
  const auto two = commands_of(planner.move_c(kBent, {}, p1, p2, p3));
  ASSERT_EQ(two.size(), 2u);
  EXPECT_EQ(two[0].kind, MotionKind::kLine);
  EXPECT_EQ(two[1].kind, MotionKind::kArc);
  EXPECT_EQ(two[1].start_q, two[0].end_q);
  const ArcMotion& arc = two[1].arc;
  EXPECT_NEAR(arc.radius_m, 0.03, 1e-15);
  EXPECT_NEAR(arc.angle_rad, deg(180), 1e-12);
  EXPECT_LT(test::distance(point_at(arc, 0.0).position_m, p1), 1e-15);
  EXPECT_LT(test::distance(point_at(arc, 0.5).position_m, p2), 1e-15);
  EXPECT_LT(test::distance(point_at(arc, 1.0).position_m, p3), 1e-15);
  const auto one = commands_of(planner.move_c({two[0].end_q, 0.0}, {}, p1, p2, p3));
  EXPECT_EQ(one.size(), 1u);
  // The long way round when P2 lies there.
  const auto far = commands_of(planner.move_c({two[0].end_q, 0.0}, {}, p1, p3, p2));
  EXPECT_NEAR(far.front().arc.angle_rad, deg(270), 1e-12);
}

TEST(MoveC, KeepsTheVectorOfAccelerationWithinTheLimit) {
  ArmModel arm = lynx5();
  arm.path.speed_m_s = 10.0;  // a tight circle is limited by v²/r alone
  const PlanResult plan =
      Planner(arm).move_c(kBent, {}, {0.22, 0.0, 0.12}, {0.22, 0.01, 0.13}, {0.22, 0.0, 0.14});
  const Command command = commands_of(plan).back();
  const PlannedRate& rate = plan.rates.back();
  const rate::RatePieces law{rate.pieces, command.duration_s, rate.knots.back().lambda_s};
  const auto place = [&](double t_s) {
    return rate::state_at(rate.knots, law.at(t_s).lambda_s)[rate::kPath];
  };
  double speed = 0.0;
  for (double t_s = 0.0; t_s < command.duration_s; t_s += 1e-3)
    speed = std::max(speed, (place(t_s + 1e-3) - place(t_s)) * length_m(command.arc) / 1e-3);
  EXPECT_LE(speed * speed / command.arc.radius_m, 1.0);
  EXPECT_GT(speed * speed / command.arc.radius_m, 0.05);
}

TEST(Drive, MovesOneJointAtTheSpeedGiven) {
  const Command command = only(Planner(lynx5()).drive(kBent, {}, 2, deg(-40), deg(20)));
  EXPECT_NEAR(command.end_q[2], deg(20), 1e-15);
  EXPECT_EQ(command.end_q[1], kBent.position_q[1]);
  EXPECT_NEAR(peaks(command.joint.law[2]).velocity, deg(20), 1e-12);
  EXPECT_EQ(only(Planner(lynx5()).drive(kBent, {}, 0, deg(10), deg(180))).end_q[0], 0.1 + deg(10));
  EXPECT_EQ(only(Planner(lynx5()).drive(kBent, {}, 0, 0.0, deg(1))).duration_s, 0.0);
}

TEST(Ready, GoesToAllZeros) {
  const Command command = only(Planner(lynx5()).ready(kBent, {}));
  for (std::size_t i = 0; i < 4; ++i) EXPECT_NEAR(command.end_q[i], 0.0, 1e-16);
}

TEST(Dwell, StandsStill) {
  const Command command = only(Planner(lynx5()).dwell(kBent, 1.5));
  EXPECT_EQ(command.kind, MotionKind::kDwell);
  EXPECT_EQ(command.dwell.duration_s, 1.5);
  EXPECT_EQ(command.duration_s, 1.5);
  EXPECT_EQ(command.end_q, kBent.position_q);
  EXPECT_EQ(only(Planner(lynx5()).dwell(kBent, 0.0)).duration_s, 0.0);
}

TEST(Gripper, TakesItsTravelTimeForTheFullTravel) {
  const Planner planner(lynx5());
  const Command full = only(planner.gripper({{}, 0.0}, 1.0));
  EXPECT_EQ(full.kind, MotionKind::kGripper);
  EXPECT_NEAR(full.duration_s, 0.5, 1e-12);
  const Command part = only(planner.gripper({{}, 0.75}, 0.5));
  EXPECT_EQ(part.gripper.from, 0.75);
  EXPECT_EQ(part.gripper.law.distance, -0.25);
  EXPECT_LT(part.duration_s, 0.5);
  EXPECT_EQ(only(planner.gripper({{}, 1.0}, 1.0)).duration_s, 0.0);
}

}  // namespace
}  // namespace corbot::motions_test
