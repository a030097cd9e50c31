// SPDX-License-Identifier: Apache-2.0
// Motions to a whole pose and by an offset: where they end, what they keep, and how they are refused.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>
#include <numbers>
#include <utility>

#include "corbot/motion/law_evaluation.h"
#include "corbot/motion/path.h"
#include "corbot/motion/path_joints.h"
#include "planner/frame_settings.h"
#include "planner/planner.h"
#include "planner/tool_goal.h"
#include "published_arm.h"
#include "test_arm.h"

namespace corbot::poses_test {
namespace {

using test::deg;
using test::lynx5;
using test::published_arm;
using ::testing::HasSubstr;
using Kind = PlanRefusal::Kind;

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kInf = std::numeric_limits<double>::infinity();

/// Comfortable: elbow and wrist bent.
const Joints kPumaBent{0.1, 0.8, -2.6, 0.2, 0.9, -0.3};
const Joints kLynxBent{0.1, deg(40), deg(60), deg(55), 0.0, 0.0};

Command only(const PlanResult& result) {
  if (const auto* refusal = std::get_if<PlanRefusal>(&result)) {
    ADD_FAILURE() << refusal->text;
    return {};
  }
  EXPECT_EQ(std::get<std::vector<Command>>(result).size(), 1u);
  return std::get<std::vector<Command>>(result).front();
}

PlanRefusal refused(const PlanResult& result) {
  if (const auto* refusal = std::get_if<PlanRefusal>(&result)) {
    EXPECT_LT(refusal->text.size(), 192u) << refusal->text;  // what the C interface holds
    return *refusal;
  }
  ADD_FAILURE() << "planned";
  return {Kind::kBadParameter, "planned", Quantity::kNumber};
}

void expect_at(const ArmModel& arm, const Command& command, const Pose& wanted) {
  const Pose end = arm.kinematics.forward(command.end_q);
  EXPECT_LT(test::distance(end.position_m, wanted.position_m), 1e-9);
  EXPECT_LT(angle_between(end.orientation, wanted.orientation), 1e-9);
}

Quaternion turn_about(const Vector3& axis, double angle_rad) {
  return about((1.0 / norm(axis)) * axis, angle_rad);
}

class PumaPoses : public testing::Test {
 protected:
  PlanResult to(const Pose& target, bool straight, double t_s = 0.0, const PlanSettings& settings = {}) {
    return Planner(arm_).plan(start_, settings, MovePoseRequest{target, t_s, straight});
  }
  PlanResult by(const Pose& offset, OffsetFrame frame, bool straight, const PlanSettings& settings = {}) {
    return Planner(arm_).plan(start_, settings, MoveRelativeRequest{offset, frame, 0.0, straight});
  }
  const ArmModel arm_ = published_arm("puma560");
  const PlanStart start_{kPumaBent, 0.25};
  const Pose here_ = arm_.kinematics.forward(kPumaBent);
  const Pose there_{here_.position_m + Vector3{0.05, -0.08, 0.06},
                    turn_about({1, -2, 0.5}, 0.7) * here_.orientation};
};

/// With the wrist's axes in line, a turn about another axis than the present one of joint 4 begins with a
/// jump of that joint.
TEST_F(PumaPoses, NoJointJumpsWhereALineBeginsAtASingularity) {
  const PlanStart in_line{{0.1, 0.8, -2.6, 0.0, 0.0, 0.0}, 0.0};
  constexpr double kTick_s = 1e-3;
  constexpr int kTicks = 3000;  // what could jump does so at the start
  int planned = 0;
  for (int k = -20; k <= 20; ++k) {
    const double phi = 0.5 * std::numbers::pi + 0.025 * k;
    const Pose turn{{}, turn_about({std::cos(phi), std::sin(phi), 0.0}, 0.3)};
    const PlanResult result =
        Planner(arm_).plan(in_line, {}, MoveRelativeRequest{turn, OffsetFrame::kTool, 0.0, true});
    if (std::holds_alternative<PlanRefusal>(result)) continue;
    ++planned;
    const Command command = only(result);
    const PlannedRate& rate = result.rates.front();
    const rate::RatePieces law{rate.pieces, command.duration_s, rate.knots.back().lambda_s};
    Joints last = command.start_q;
    for (int tick = 1; tick <= kTicks && tick * kTick_s < command.duration_s; ++tick) {
      const rate::State now = rate::state_at(rate.knots, law.at(tick * kTick_s).lambda_s);
      for (std::size_t i = 0; i < arm_.dof; ++i) {
        ASSERT_LE(std::abs(now[i] - last[i]), arm_.joints[i].speed_q_s * kTick_s * 1.01)
            << "axis " << k << ", joint " << i << ", tick " << tick << " of " << command.duration_s << " s";
      }
      std::copy_n(now.begin(), last.size(), last.begin());
    }
  }
  EXPECT_GT(planned, 0) << "the present axis of joint 5 leads out of it";
}

/// Neither moves the tool centre point, and the second moves the wrist about it.
TEST_F(PumaPoses, TurnsInPlaceAreProvedAsOtherLinesAre) {
  PlanSettings with_tool;
  with_tool.tool_frame = Pose{{0.0, 0.0, 0.1}, {}};
  const Pose turn{{}, turn_about({0, 1, 0}, 0.35)};
  EXPECT_EQ(only(by(turn, OffsetFrame::kTool, true)).kind, MotionKind::kLine);
  EXPECT_EQ(only(by(turn, OffsetFrame::kTool, true, with_tool)).kind, MotionKind::kLine);
  // About the last axis, further than its range lets it.
  ArmModel narrow = arm_;
  narrow.joints[5].upper_q = start_.position_q[5] + 0.4;
  const Pose over{{}, turn_about({0, 0, 1}, 0.5)};
  EXPECT_EQ(
      refused(Planner(narrow).plan(start_, {}, MoveRelativeRequest{over, OffsetFrame::kTool, 0.0, true}))
          .parameter,
      "joint range");
}

/// Beyond a straight wrist the same solution has joints 3 and 5 half a turn further, so the line goes on by
/// another one, whatever the range of joint 3.
TEST_F(PumaPoses, ALineLeadsThroughAStraightWrist) {
  const Pose over{{}, turn_about({0, 1, 0}, 2.0)};  // joint 4 from 0.9 to -1.1
  const PlanStart start{{0.1, 0.8, -2.6, 0.0, 0.9, 0.0}, 0.25};
  for (const auto& [lower_deg, upper_deg] : {std::pair{-110, 170}, {-200, 200}, {-224, 284}}) {
    ArmModel arm = arm_;
    arm.joints[3].lower_q = deg(lower_deg);
    arm.joints[3].upper_q = deg(upper_deg);
    const PlanResult plan =
        Planner(arm).plan(start, {}, MoveRelativeRequest{over, OffsetFrame::kTool, 0.0, true});
    const Command line = only(plan);
    ASSERT_EQ(line.kind, MotionKind::kLine) << upper_deg;
    for (std::size_t i = 0; i < arm.dof; ++i)
      EXPECT_NEAR(line.end_q[i], i == 4 ? -1.1 : start.position_q[i], 1e-6) << i;
    EXPECT_LT(line.duration_s, 5.0) << upper_deg;
  }
}

TEST_F(PumaPoses, BothMotionsEndAtThePose) {
  const Command joints = only(to(there_, false));
  EXPECT_EQ(joints.kind, MotionKind::kJoint);
  expect_at(arm_, joints, there_);
  const Command line = only(to(there_, true));
  EXPECT_EQ(line.kind, MotionKind::kLine);
  expect_at(arm_, line, there_);
  EXPECT_NEAR(norm(line.line.tool.turn_rad), 0.7, 1e-12) << "the shorter way";
  const Pose flipped{
      there_.position_m,
      {-there_.orientation.w, -there_.orientation.x, -there_.orientation.y, -there_.orientation.z}};
  EXPECT_NEAR(norm(only(to(flipped, true)).line.tool.turn_rad), 0.7, 1e-12) << "q and -q are one rotation";
  expect_at(arm_, only(to(flipped, true)), there_);
}

TEST_F(PumaPoses, TakeTheTimeThatIsAskedForOrWhatTheLimitsAllow) {
  for (const bool straight : {false, true}) {
    const double shortest_s = only(to(there_, straight)).duration_s;
    EXPECT_GT(shortest_s, 0.1);
    EXPECT_EQ(only(to(there_, straight, 0.5 * shortest_s)).duration_s, shortest_s);
    EXPECT_EQ(only(to(there_, straight, 7.25)).duration_s, 7.25);
  }
}

TEST_F(PumaPoses, TheTargetCountsAndNotTheOrientationThatWasSet) {
  PlanSettings set;
  set.tool_orientation = turn_about({0, 0, 1}, 1.1);
  for (const bool straight : {false, true}) expect_at(arm_, only(to(there_, straight, 0.0, set)), there_);
}

TEST_F(PumaPoses, ATurnOnTheSpot) {
  const Pose turned{here_.position_m, turn_about({0, 1, 0}, 0.4) * here_.orientation};
  const Command line = only(to(turned, true));
  expect_at(arm_, line, turned);
  EXPECT_GT(line.duration_s, 0.4 / arm_.path.rotation_speed_rad_s);
  EXPECT_EQ(only(to(here_, true)).duration_s, 0.0);
}

TEST_F(PumaPoses, AQuaternionWrittenWithSixDigitsIsTakenForTheRotationThatItMeans) {
  const double half_off = 5e-7;
  const Quaternion& q = there_.orientation;
  const double k = 1.0 + half_off;
  const Pose longer{there_.position_m, {k * q.w, k * q.x, k * q.y, k * q.z}};
  for (const bool straight : {false, true}) expect_at(arm_, only(to(longer, straight)), there_);
}

TEST_F(PumaPoses, NotAQuaternionOfUnitLength) {
  for (const bool straight : {false, true}) {
    const PlanRefusal longer = refused(to({there_.position_m, {1.0, 0.1, 0.0, 0.0}}, straight));
    EXPECT_EQ(longer.kind, Kind::kBadParameter);
    EXPECT_EQ(longer.parameter, "target");
    EXPECT_NEAR(longer.value, std::sqrt(1.01), 1e-15);
    EXPECT_THAT(longer.text, HasSubstr("length 1.00499, allowed 1 within 1e-06"));
    EXPECT_EQ(refused(to({there_.position_m, {0, 0, 0, 0}}, straight)).value, 0.0);
    EXPECT_EQ(refused(to({there_.position_m, {1.0 + 2e-6, 0, 0, 0}}, straight)).parameter, "target");
    for (const double bad : {kNan, kInf, -kInf}) {
      const PlanRefusal refusal = refused(to({there_.position_m, {1.0, 0.0, bad, 0.0}}, straight));
      EXPECT_EQ(refusal.kind, Kind::kBadParameter);
      EXPECT_THAT(refusal.text, HasSubstr("y of the orientation of target is"));
      EXPECT_FALSE(std::isfinite(refusal.value));
    }
    for (const double bad : {kNan, kInf, 1e308}) {
      const PlanRefusal refusal = refused(to({{0.3, bad, 0.2}, {}}, straight));
      EXPECT_EQ(refusal.kind, Kind::kBadParameter);
      EXPECT_THAT(refusal.text, HasSubstr("y of target is"));
    }
    EXPECT_EQ(refused(to(there_, straight, -1.0)).parameter, "t");
  }
  const PlanRefusal offset = refused(by({{}, {0.9, 0, 0, 0}}, OffsetFrame::kTool, true));
  EXPECT_EQ(offset.parameter, "offset");
  EXPECT_EQ(refused(by({{kNan, 0, 0}, {}}, OffsetFrame::kBase, false)).parameter, "offset");
}

TEST_F(PumaPoses, OutOfReachAndOutOfRange) {
  for (const bool straight : {false, true}) {
    const PlanRefusal far = refused(to({{2.0, 0.0, 0.3}, {}}, straight));
    EXPECT_EQ(far.kind, Kind::kUnreachable);
    EXPECT_EQ(far.target_m, (Vector3{2.0, 0.0, 0.3}));
  }
  ArmModel narrow = arm_;
  for (std::size_t i = 0; i < 6; ++i) {
    narrow.joints[i].lower_q = kPumaBent[i] - 0.01;
    narrow.joints[i].upper_q = kPumaBent[i] + 0.01;
  }
  for (const bool straight : {false, true}) {
    const PlanRefusal refusal =
        refused(Planner(narrow).plan(start_, {}, MovePoseRequest{there_, 0.0, straight}));
    EXPECT_EQ(refusal.kind, Kind::kLimitExceeded);
    EXPECT_EQ(refusal.parameter, "joint range");
  }
}

TEST_F(PumaPoses, AnOffsetCountsAlongTheAxesOfItsFrame) {
  const Pose offset{{0.02, -0.03, 0.04}, turn_about({1, 1, 0}, 0.3)};
  for (const bool straight : {false, true}) {
    expect_at(arm_, only(by(offset, OffsetFrame::kTool, straight)), here_ * offset);
    // In the base frame the tool centre point is what the tool turns about.
    expect_at(arm_, only(by(offset, OffsetFrame::kBase, straight)),
              {here_.position_m + offset.position_m, offset.orientation * here_.orientation});
  }
}

TEST_F(PumaPoses, AnOffsetWithoutATurnKeepsTheOrientationWhateverWasSet) {
  PlanSettings set;
  set.tool_orientation = turn_about({0, 0, 1}, 1.1);
  const Pose along{{0.0, 0.0, -0.05}, {}};
  for (const bool straight : {false, true}) {
    expect_at(arm_, only(by(along, OffsetFrame::kTool, straight, set)), here_ * along);
  }
  EXPECT_EQ(only(by({}, OffsetFrame::kTool, true)).duration_s, 0.0);
}

TEST(LynxPoses, TheOrientationThatAFourAxisArmCanTake) {
  const ArmModel arm = lynx5();
  const Planner planner(arm);
  const Pose there = arm.kinematics.forward({-0.3, deg(55), deg(45), deg(20), 0, 0});
  for (const bool straight : {false, true}) {
    expect_at(arm, only(planner.plan({kLynxBent, 0}, {}, MovePoseRequest{there, 0, straight})), there);
  }
}

TEST(LynxPoses, TheNearestOrientationIsRefusedAboveTheLimit) {
  ArmModel arm = lynx5();
  const Pose can = arm.kinematics.forward({-0.3, deg(55), deg(45), deg(20), 0, 0});
  // About the tool's own axis, which this arm cannot turn.
  const Pose wanted{can.position_m, can.orientation * turn_about({1, 0, 0}, deg(5))};
  for (const bool straight : {false, true}) {
    const MovePoseRequest request{wanted, 0.0, straight};
    arm.orientation_error_rad = 0.0;
    const PlanRefusal refusal = refused(Planner(arm).plan({kLynxBent, 0}, {}, request));
    EXPECT_EQ(refusal.kind, Kind::kUnreachable);
    EXPECT_EQ(refusal.parameter, "orientation");
    EXPECT_THAT(refusal.text, HasSubstr("than 5 degrees, allowed up to 5.72958e-05 degrees"));
    EXPECT_NEAR(refusal.value, deg(5), 1e-9);
    EXPECT_EQ(refusal.target_m, wanted.position_m);
    arm.orientation_error_rad = deg(4.9);
    EXPECT_THAT(refused(Planner(arm).plan({kLynxBent, 0}, {}, request)).text,
                HasSubstr("allowed up to 4.9 degrees"));
    arm.orientation_error_rad = deg(5.1);
    expect_at(arm, only(Planner(arm).plan({kLynxBent, 0}, {}, request)), can);
  }
}

/// Arms that do not follow every orientation, each from somewhere comfortable.
struct Lesser {
  const char* name;
  Joints from;
  Vector3 offset_m;
};

class LesserArms : public testing::TestWithParam<Lesser> {};

TEST_P(LesserArms, AnOffsetWithoutATurnKeepsWhatTheyFollow) {
  const ArmModel arm = published_arm(GetParam().name);
  const Pose here = arm.kinematics.forward(GetParam().from);
  const Angles before = arm.kinematics.followed().at(GetParam().from);
  PlanSettings pitched;
  if (has_tool_pitch(arm.kinematics)) pitched.tool_pitch_rad = 0.1234;  // for Move, and not for this
  for (const bool straight : {false, true}) {
    for (const OffsetFrame frame : {OffsetFrame::kBase, OffsetFrame::kTool}) {
      const MoveRelativeRequest request{{GetParam().offset_m, {}}, frame, 0.0, straight};
      const Command command = only(Planner(arm).plan({GetParam().from, 0}, pitched, request));
      const Vector3 wanted_m = frame == OffsetFrame::kBase
                                   ? here.position_m + GetParam().offset_m
                                   : (here * Pose{GetParam().offset_m, {}}).position_m;
      EXPECT_LT(test::distance(arm.kinematics.forward(command.end_q).position_m, wanted_m), 1e-9);
      const Angles after = arm.kinematics.followed().at(command.end_q);
      for (std::size_t k = 0; k < arm.kinematics.followed().count; ++k)
        EXPECT_NEAR(wrap_angle(after[k] - before[k]), 0.0, 1e-9) << k;
    }
  }
}

INSTANTIATE_TEST_SUITE_P(
    Arms, LesserArms,
    testing::Values(Lesser{"al5d", {0.2, 0.6, 1.0, 0.4, 0, 0}, {0.01, 0.005, 0.01}},
                    Lesser{"al5d_wr", {0.2, 1.6, -1.5, -0.4, 0.3, 0}, {0.01, 0.005, 0.01}},
                    Lesser{"scara_cobra600", {0.3, 0.9, 0.05, 0.2, 0, 0}, {0.01, 0.02, 0.01}},
                    Lesser{"cartesian_ppp", {0.2, 0.2, 0.1, 0, 0, 0}, {0.01, 0.02, 0.03}},
                    Lesser{"cylindrical_rpp", {0.3, 0.2, 0.2, 0, 0, 0}, {0.01, 0.02, 0.03}}),
    [](const auto& arm) { return std::string(arm.param.name); });

/// Hung from a ceiling, where an inclination that the arm counts upward is a pitch downward; and with a tool
/// that is tilted in the hand.
TEST(LynxPoses, AnOffsetKeepsThePitchOfAnArmThatHangs) {
  const ArmModel arm = test::wide_arm();
  PlanSettings settings;
  settings.base_frame = Pose{{0.0, 0.0, 1.0}, {0.0, 1.0, 0.0, 0.0}};
  for (const double tilt_rad : {0.0, 0.3}) {
    settings.tool_frame =
        Pose{frames_of(arm.kinematics).n_T_tool.position_m,
             frames_of(arm.kinematics).n_T_tool.orientation * about({0.0, 1.0, 0.0}, tilt_rad)};
    const Kinematics hung = in_frames(arm.kinematics, settings);
    const Pose here = hung.forward(kLynxBent);
    for (const bool straight : {false, true}) {
      const MoveRelativeRequest request{{{0.01, 0.005, 0.01}, {}}, OffsetFrame::kBase, 0.0, straight};
      const Command command = only(Planner(arm).plan({kLynxBent, 0}, settings, request));
      const Pose there = hung.forward(command.end_q);
      EXPECT_LT(test::distance(there.position_m, here.position_m + request.offset.position_m), 1e-9);
      EXPECT_NEAR(wrap_angle(hung.followed().at(command.end_q)[0] - hung.followed().at(kLynxBent)[0]), 0.0,
                  1e-9);
      EXPECT_NEAR(tool_pose(hung, command.end_q).pitch_rad, tool_pose(hung, kLynxBent).pitch_rad, 1e-9);
    }
    settings.tool_pitch_rad = 0.2;
    const Command level = only(Planner(arm).move({kLynxBent, 0}, settings, here.position_m, 0.0));
    EXPECT_NEAR(tool_pose(hung, level.end_q).pitch_rad, 0.2, 1e-9) << "above the horizontal";
  }
}

TEST(LynxPoses, AFollowedAngleGoesTheShorterWay) {
  const ArmModel arm = lynx5();
  PathPoint from, to;
  from.angles_rad[0] = 3.0;
  to.angles_rad[0] = -3.0;
  const OrientationPath path = orientation_path(arm.kinematics, from, to);
  EXPECT_EQ(path.from_angles_rad[0], 3.0);
  EXPECT_NEAR(path.to_angles_rad[0], 2.0 * std::numbers::pi - 3.0, 1e-15);
}

TEST(LynxPoses, AnOffsetThatTurnsIsAPose) {
  const ArmModel arm = lynx5();
  const Planner planner(arm);
  const auto by = [&](const Quaternion& turn, bool straight) {
    return planner.plan({kLynxBent, 0}, {}, MoveRelativeRequest{{{}, turn}, OffsetFrame::kTool, 0, straight});
  };
  const Pose here = arm.kinematics.forward(kLynxBent);
  for (const bool straight : {false, true}) {
    // Its pitch it can change; its roll it cannot.
    expect_at(arm, only(by(turn_about({0, 1, 0}, 0.2), straight)),
              here * Pose{{}, turn_about({0, 1, 0}, 0.2)});
    EXPECT_THAT(refused(by(turn_about({1, 0, 0}, 0.2), straight)).text, HasSubstr("11.4592 degrees"));
  }
}

TEST(Poses, AnOrientationThatWasSetIsForArmsThatFollowIt) {
  const ArmModel arm = published_arm("puma560");
  const Pose here = arm.kinematics.forward(kPumaBent);
  PlanSettings set;
  set.tool_orientation = turn_about({0.3, 0.2, 1}, 0.5) * here.orientation;
  const Pose there{here.position_m + Vector3{0.02, 0.03, -0.02}, *set.tool_orientation};
  const Planner planner(arm);
  expect_at(arm, only(planner.move({kPumaBent, 0}, set, there.position_m, 0.0)), there);
  expect_at(arm, only(planner.move_s({kPumaBent, 0}, set, there.position_m, 0.0)), there);
}

}  // namespace
}  // namespace corbot::poses_test
