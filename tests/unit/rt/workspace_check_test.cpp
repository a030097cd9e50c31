// SPDX-License-Identifier: Apache-2.0
// The task checks commands and set-points against the workspace, too: a servant that lies gets no farther.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <utility>
#include <vector>

#include "corbot/channel/alarms.h"
#include "corbot/channel/fingerprint.h"
#include "corbot/kinematics/arm_parts.h"
#include "corbot/kinematics/tool_pose.h"
#include "rt/cycle/workspace_check.h"
#include "rt/rig.h"

namespace corbot::test::workspace_check_test {
namespace {

constexpr std::uint32_t kTool = bit_of(0), kWrist = bit_of(1), kElbow = bit_of(2);
const Joints kBent{0.0, 0.7, 1.05, 0.96};

WorkspaceShape floor_at(double height_m) { return plane_shape({{0, 0, 1}, height_m}, kTool | kWrist); }

ArmModel arm_in(const WorkspaceShape& shape) {
  ArmModel arm = shipped_lynx5();
  arm.workspace.shapes[arm.workspace.count++] = shape;
  return arm;
}

/// An arm with a workspace, and the planner of a servant that ignores it.
class WorkspaceCheck : public ::testing::Test {
 protected:
  void begin(const ArmModel& arm, const Joints& rest_q) {
    rig_ = std::make_unique<Rig>(arm);
    rig_->restart({.position_q = rest_q, .position_known = true});
    rig_->step();
  }
  double height_m(std::size_t part) const {
    const JointChain& chain = rig_->arm.kinematics.chain();
    return part_states(chain, points_of(chain), rig_->snapshot.position_q)[part].position_m[2];
  }
  /// Runs until the next verdict. Keeps the least and greatest height of tool and elbow.
  Verdict verdict() {
    for (int i = 0; i < 20000; ++i) {
      rig_->step();
      lowest_tool_m_ = std::min(lowest_tool_m_, height_m(0));
      highest_elbow_m_ = std::max(highest_elbow_m_, height_m(2));
      if (const auto taken = rig_->completion()) return taken->verdict;
    }
    return Verdict::kLost;
  }
  static Vector3 tool_at(const Joints& q) { return shipped_lynx5().kinematics.forward(q).position_m; }

  std::unique_ptr<Rig> rig_;
  const Planner liar_{shipped_lynx5()};
  double lowest_tool_m_{1.0}, highest_elbow_m_{0.0};
};

TEST_F(WorkspaceCheck, ACommandThatEndsOutsideMovesNothing) {
  begin(arm_in(floor_at(0.0)), kBent);
  Joints below = kBent;
  below[1] = -0.2;
  PlanSettings settings;
  settings.tool_pitch_rad = tool_pose(shipped_lynx5().kinematics, kBent).pitch_rad;
  const Vector3 here = tool_at(kBent), target{here[0], here[1], -0.05};
  for (const PlanResult& plan :
       {liar_.move_joints(rig_->start(), {}, below, 0.0), liar_.move(rig_->start(), settings, target, 0.0),
        liar_.move_s(rig_->start(), settings, target, 0.0)}) {
    rig_->submit(plan);
    EXPECT_EQ(verdict(), Verdict::kLimit);
    EXPECT_EQ(rig_->alarm()->code, AlarmCode::kCommandRefused);
    EXPECT_EQ(rig_->snapshot.position_q, kBent);
    EXPECT_EQ(rig_->snapshot.state, RtState::kStandby);
  }
}

TEST_F(WorkspaceCheck, ASetPointOutsideIsAFaultAndIsNotEmitted) {
  // The elbow swings over the top: both ends lie below the ceiling.
  begin(arm_in(plane_shape({{0, 0, -1}, -0.18}, kElbow)), kBent);
  Joints there = kBent;
  there[1] = 2.18;
  PlanSettings slow;
  slow.speed_ratio = 0.02;
  rig_->submit(liar_.move_joints(rig_->start(), slow, there, 0.0));
  EXPECT_EQ(verdict(), Verdict::kFault);
  EXPECT_EQ(rig_->snapshot.state, RtState::kError);
  const auto alarm = rig_->alarm();
  ASSERT_TRUE(alarm.has_value());
  ASSERT_EQ(alarm->code, AlarmCode::kSetPointOutsideWorkspace);
  const alarm::OutsideWorkspace what = alarm::outside_workspace(*alarm);
  EXPECT_EQ(what.shape, 0u);
  EXPECT_EQ(what.part, 2u);
  EXPECT_LT(what.clearance_m, -rt::WorkspaceCheck::kTolerance_m);
  EXPECT_LT(highest_elbow_m_, 0.1802) << "unguarded it would reach 0.187";
}

TEST_F(WorkspaceCheck, ALineAndAnArcAreCheckedBetweenTheirEnds) {
  const Vector3 here = tool_at(kBent);
  const WorkspaceShape post = box_shape(ShapeKind::kOutside, {here[0] - 0.05, 0.03, here[2] - 0.05},
                                        {here[0] + 0.05, 0.05, here[2] + 0.05}, kTool);
  PlanSettings slow;
  slow.speed_ratio = 0.02;
  slow.tool_pitch_rad = tool_pose(shipped_lynx5().kinematics, kBent).pitch_rad;
  const PlanStart start{kBent, 0.0};
  const Vector3 to = here + Vector3{0.0, 0.08, 0.0}, over = here + Vector3{0.01, 0.04, 0.0};
  for (const PlanResult& plan :
       {liar_.move_s(start, slow, to, 0.0), liar_.move_c(start, slow, here, over, to)}) {
    begin(arm_in(post), kBent);
    rig_->submit(plan);
    EXPECT_EQ(verdict(), Verdict::kFault);
    EXPECT_EQ(rig_->alarm()->code, AlarmCode::kSetPointOutsideWorkspace);
    EXPECT_LT(tool_at(rig_->snapshot.position_q)[1], 0.0305);
  }
}

TEST_F(WorkspaceCheck, ALinkIsCheckedBetweenItsEnds) {
  const JointChain chain = shipped_lynx5().kinematics.chain();
  const auto states = part_states(chain, points_of(chain), kBent);
  const Vector3 middle = 0.5 * (states[1].position_m + states[2].position_m), half{0.01, 0.01, 0.01};
  ArmModel arm = arm_in(box_shape(ShapeKind::kOutside, middle - half, middle + half, bit_of(4)));
  arm.workspace.link_radius_m = {0.02, 0.02, 0.02};
  Joints from = kBent, there = kBent;
  from[0] = -0.6;
  there[0] = 0.6;
  begin(arm, from);
  PlanSettings slow;
  slow.speed_ratio = 0.02;
  rig_->submit(liar_.move_joints(rig_->start(), slow, there, 0.0));
  EXPECT_EQ(verdict(), Verdict::kFault);
  const auto alarm = rig_->alarm();
  ASSERT_TRUE(alarm.has_value());
  EXPECT_EQ(alarm->code, AlarmCode::kSetPointOutsideWorkspace);
  EXPECT_EQ(alarm::outside_workspace(*alarm).part, 4u);
  EXPECT_LT(rig_->snapshot.position_q[0], 0.0);
}

TEST_F(WorkspaceCheck, TheFramesOfAJointCommandCount) {
  begin(arm_in(floor_at(0.0)), kBent);
  PlanSettings sunk;
  sunk.base_frame = Pose{{0, 0, -0.5}, {}};
  const Joints lower{0.0, 0.6, 1.05, 0.96}, higher{0.0, 0.8, 1.05, 0.96};
  rig_->submit(liar_.move_joints(rig_->start(), sunk, lower, 0.0));
  EXPECT_EQ(verdict(), Verdict::kLimit);
  rig_->submit(rig_->planner.move_joints(rig_->start(), sunk, higher, 0.0));
  EXPECT_EQ(verdict(), Verdict::kDone);
}

TEST_F(WorkspaceCheck, LetsPassWhatThePlannerProves) {
  begin(arm_in(floor_at(0.0)), kBent);
  PlanSettings settings;
  settings.tool_pitch_rad = tool_pose(shipped_lynx5().kinematics, kBent).pitch_rad;
  const Vector3 here = tool_at(kBent);
  const auto run = [&](const PlanResult& plan) {
    ASSERT_TRUE(std::holds_alternative<std::vector<Command>>(plan)) << std::get<PlanRefusal>(plan).text;
    rig_->submit(plan);
    EXPECT_EQ(verdict(), Verdict::kDone);
    EXPECT_FALSE(rig_->alarm().has_value());
  };
  run(rig_->planner.move_s(rig_->start(), settings, {here[0], 0.0, 0.0}, 0.0));
  run(rig_->planner.move_s(rig_->start(), settings, {here[0], 0.08, 0.0}, 0.0));
  run(rig_->planner.move(rig_->start(), settings, here, 0.0));
  EXPECT_GT(lowest_tool_m_, -kWorkspaceTolerance_m);
}

TEST_F(WorkspaceCheck, FromOutsideTheArmMayMoveInwardOnly) {
  Joints below = kBent;
  below[1] = -0.2;
  begin(arm_in(floor_at(0.0)), below);
  ASSERT_LT(height_m(0), -0.01);
  Joints farther = below;
  farther[1] = -0.25;
  rig_->submit(liar_.move_joints(rig_->start(), {}, farther, 0.0));
  EXPECT_EQ(verdict(), Verdict::kLimit);
  rig_->submit(rig_->planner.move_joints(rig_->start(), {}, kBent, 0.0));
  EXPECT_EQ(verdict(), Verdict::kDone);
  EXPECT_GT(height_m(0), 0.0);
}

/// Further shapes, as a servant hands them over.
class FurtherShapesCheck : public WorkspaceCheck {
 protected:
  void SetUp() override {
    begin(shipped_lynx5(), kBent);
    further_.shapes[further_.count++] = floor_at(height_m(0) - 0.01);
    down_[1] = 0.6;
  }
  Verdict verdict_of(std::uint64_t shapes) {
    auto commands = std::get<std::vector<Command>>(liar_.move_joints(rig_->start(), {}, down_, 0.0));
    for (Command& command : commands) command.shapes = shapes;
    rig_->submit(commands);
    return verdict();
  }

  FurtherShapes further_;
  Joints down_{kBent};
};

TEST_F(FurtherShapesCheck, ACommandThatEndsBeyondThemMovesNothing) {
  rig_->servant->shapes.store(further_);
  EXPECT_EQ(verdict_of(number_of(further_)), Verdict::kLimit);
  EXPECT_EQ(verdict_of(0), Verdict::kDone) << "a command that names none is not held to them";
}

TEST_F(FurtherShapesCheck, OfWhichACommandNamesOthersOrThatAreUnsoundRefuseIt) {
  EXPECT_EQ(verdict_of(number_of(further_)), Verdict::kMalformed) << "none are written";
  rig_->servant->shapes.store(further_);
  EXPECT_EQ(verdict_of(number_of(further_) + 1), Verdict::kMalformed);
  for (const auto& spoil : std::vector<std::function<void(FurtherShapes&)>>{
           [](FurtherShapes& of) { of.shapes[0].faces[0].normal[2] = 1.1; },
           [](FurtherShapes& of) { of.shapes[0].faces[0].offset_m = std::nan(""); },
           [](FurtherShapes& of) { of.shapes[0].face_count = 2; },
           [](FurtherShapes& of) { of.shapes[0].kind = static_cast<ShapeKind>(7); }}) {
    FurtherShapes bad = further_;
    spoil(bad);
    rig_->servant->shapes.store(bad);
    EXPECT_EQ(verdict_of(number_of(bad)), Verdict::kMalformed);
  }
  FurtherShapes many = further_;
  many.count = std::uint64_t{1} << 40;
  rig_->servant->shapes.store(many);
  EXPECT_EQ(verdict_of(1), Verdict::kMalformed);
  EXPECT_EQ(rig_->snapshot.position_q, kBent);
}

TEST_F(FurtherShapesCheck, HoldForLinks) {
  ArmModel thick = shipped_lynx5();
  thick.workspace.link_radius_m = {0.02, 0.02, 0.02};
  thick.workspace.shapes[thick.workspace.count++] = floor_at(-1.0);
  begin(thick, kBent);
  // The upper arm swings over the top: both ends lie below the ceiling. The elbow itself passes unguarded.
  constexpr std::uint32_t kUpperArm = 3;
  further_ = {};
  further_.shapes[further_.count++] = plane_shape({{0, 0, -1}, -0.2}, bit_of(kUpperArm));
  rig_->servant->shapes.store(further_);
  down_ = kBent;
  down_[1] = 2.18;
  EXPECT_EQ(verdict_of(number_of(further_)), Verdict::kFault);
  const auto alarm = rig_->alarm();
  ASSERT_TRUE(alarm && alarm->code == AlarmCode::kSetPointOutsideWorkspace);
  EXPECT_EQ(alarm::outside_workspace(*alarm).shape, 1u) << "behind the profile's";
  EXPECT_EQ(alarm::outside_workspace(*alarm).part, kUpperArm);
  EXPECT_LT(rig_->snapshot.position_q[1], 2.0);
}

TEST_F(FurtherShapesCheck, OfAFormerServantHoldForItsCommands) {
  rig_->servant->shapes.store(further_);
  auto up = kBent;
  up[1] = 0.75;
  for (const Joints& to : {up, down_}) {
    auto commands =
        std::get<std::vector<Command>>(liar_.move_joints({to == up ? kBent : up, 0.0}, {}, to, 0.0));
    for (Command& command : commands) command.shapes = number_of(further_);
    rig_->submit(commands);
  }
  rig_->step(3);
  auto former = std::exchange(rig_->servant, std::make_unique<ServantSegment>());
  rig_->servant->next_command_id.store(former->next_command_id.load());
  rig_->cycle->connect({rig_->servant.get(), ++rig_->session});
  former.reset();
  EXPECT_EQ(verdict(), Verdict::kDone);
  EXPECT_EQ(verdict(), Verdict::kLimit);
}

}  // namespace
}  // namespace corbot::test::workspace_check_test
