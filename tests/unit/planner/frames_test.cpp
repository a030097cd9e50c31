// SPDX-License-Identifier: Apache-2.0
// Tool and base frames that are set, which of them are refused, and the solutions at a pose.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>

#include "planner/frame_settings.h"
#include "planner/planner.h"
#include "planner/pose_solutions.h"
#include "published_arm.h"
#include "test_arm.h"

namespace corbot::frames_test {
namespace {

using test::deg;
using test::lynx5;
using test::published_arm;
using ::testing::HasSubstr;
using Kind = PlanRefusal::Kind;

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kInfinity = std::numeric_limits<double>::infinity();

const PlanStart kBent{{0.1, 0.7, -0.6, 0.5, 0.8, -0.4}, 0.0};

Pose tool_of(const ArmModel& arm) { return frames_of(arm.kinematics).n_T_tool; }

const Command& only(const PlanResult& result) {
  const auto* commands = std::get_if<std::vector<Command>>(&result);
  if (commands == nullptr) throw std::runtime_error(std::get<PlanRefusal>(result).text);
  return commands->front();
}

TEST(Frames, AreTheProfilesUnlessTheyAreSet) {
  const ArmModel arm = published_arm("puma560");
  const Frames own = frames_in_force(arm.kinematics, {});
  EXPECT_EQ(own.n_T_tool.position_m, tool_of(arm).position_m);
  PlanSettings settings;
  settings.tool_frame = Pose{{0.0, 0.0, 0.2}, {}};
  const Frames one = frames_in_force(arm.kinematics, settings);
  EXPECT_EQ(one.n_T_tool.position_m[2], 0.2);
  EXPECT_EQ(one.base_T_0.position_m, own.base_T_0.position_m) << "the other stays";
}

TEST(Frames, ALineIsTheSetToolsAndSaysSoInItsRecord) {
  const ArmModel arm = published_arm("puma560");
  PlanSettings settings;
  settings.tool_frame = Pose{{0.03, -0.02, 0.15}, about({0.0, 1.0, 0.0}, 0.7)};
  settings.base_frame = Pose{{1.0, 2.0, -0.5}, about({0.0, 0.0, 1.0}, 1.1)};
  const Kinematics framed = in_frames(arm.kinematics, settings);
  Vector3 target = framed.forward(kBent.position_q).position_m;
  target[1] += 0.1;
  const Command line = only(Planner(arm).move_s(kBent, settings, target, 0.0));
  EXPECT_LT(test::distance(framed.forward(line.end_q).position_m, target), 1e-12);
  EXPECT_GT(test::distance(arm.kinematics.forward(line.end_q).position_m, target), 0.5);
  EXPECT_EQ(line.line.frames.n_T_tool.position_m, settings.tool_frame->position_m);
  EXPECT_EQ(line.line.frames.base_T_0.position_m, settings.base_frame->position_m);
  EXPECT_EQ(line.line.frames.base_T_0.orientation.w, settings.base_frame->orientation.w);
}

TEST(Frames, ARecordHasTheProfilesWhereNoneAreSet) {
  const ArmModel arm = published_arm("scara_gx4");
  const PlanStart from{{0.2, 0.9, -0.05, 0.3}, 0.0};
  Vector3 target = arm.kinematics.forward(from.position_q).position_m;
  target[2] += 0.01;
  const Command line = only(Planner(arm).move_s(from, {}, target, 0.0));
  const Frames own = frames_of(arm.kinematics);
  EXPECT_EQ(line.line.frames.n_T_tool.orientation.x, own.n_T_tool.orientation.x);
  EXPECT_TRUE(are_frames(line.line.frames));
}

TEST(Frames, TheTwoPartsOfAnArcHaveTheSame) {
  const ArmModel arm = published_arm("puma560");
  PlanSettings settings;
  settings.tool_frame = Pose{{0.0, 0.0, 0.12}, {}};
  const Vector3 p = in_frames(arm.kinematics, settings).forward(kBent.position_q).position_m;
  const PlanResult result = Planner(arm).move_c(kBent, settings, {p[0], p[1] + 0.02, p[2]},
                                                {p[0] + 0.02, p[1] + 0.04, p[2]}, {p[0], p[1] + 0.06, p[2]});
  ASSERT_TRUE(std::holds_alternative<std::vector<Command>>(result)) << std::get<PlanRefusal>(result).text;
  const auto& two = std::get<std::vector<Command>>(result);
  ASSERT_EQ(two.size(), 2u);
  EXPECT_EQ(two[0].line.frames.n_T_tool.position_m[2], 0.12);
  EXPECT_EQ(two[1].arc.frames.n_T_tool.position_m[2], 0.12);
}

TEST(Frames, ThatAreNoneAreRefusedByNameAndLimit) {
  const ArmModel arm = published_arm("puma560");
  const Pose good{{0.1, 0.0, 0.2}, {}};
  EXPECT_FALSE(check_tool_frame(arm.kinematics, good));
  EXPECT_FALSE(check_base_frame(good));
  for (const double wrong : {kNan, kInfinity, -kInfinity, 11.0, -10.5}) {
    Pose frame = good;
    frame.position_m[1] = wrong;
    const auto refusal = check_tool_frame(arm.kinematics, frame);
    ASSERT_TRUE(refusal) << wrong;
    EXPECT_EQ(refusal->kind, Kind::kBadParameter);
    EXPECT_EQ(refusal->parameter, "flange_T_tool");
    EXPECT_EQ(refusal->upper, kFarthestTool_m);
    EXPECT_THAT(refusal->text, HasSubstr("allowed -10 to 10"));
  }
  Pose far = good;
  far.position_m[0] = -99.0;
  EXPECT_FALSE(check_base_frame(far));
  far.position_m[0] = -100.5;
  ASSERT_TRUE(check_base_frame(far));
  EXPECT_EQ(check_base_frame(far)->parameter, "world_T_base");
  EXPECT_EQ(check_base_frame(far)->value, -100.5);
  for (const Quaternion wrong : {Quaternion{0.0, 0.0, 0.0, 0.0}, Quaternion{1.0 + 2e-6, 0.0, 0.0, 0.0},
                                 Quaternion{kNan, 0.0, 0.0, 1.0}, Quaternion{1.0, 0.0, kInfinity, 0.0},
                                 Quaternion{1e200, 1e200, 0.0, 0.0}}) {
    EXPECT_TRUE(check_tool_frame(arm.kinematics, {{}, wrong})) << wrong.w;
    EXPECT_TRUE(check_base_frame({{}, wrong})) << wrong.w;
  }
  EXPECT_FALSE(check_base_frame({{}, {1.0 + 0.9e-6, 0.0, 0.0, 0.0}})) << "six digits";
}

TEST(Frames, AToolThatAnArmCannotTakeIsRefused) {
  const ArmModel lynx = lynx5();
  // y of the flange is square to the plane of the arm but for the profile's quarter turn about x: the tool's
  // x along it.
  const Pose across{{}, tool_of(lynx).orientation * about({0.0, 0.0, 1.0}, deg(90))};
  const auto no_pitch = check_tool_frame(lynx.kinematics, across);
  ASSERT_TRUE(no_pitch);
  EXPECT_THAT(no_pitch->text, HasSubstr("no pitch"));
  EXPECT_FALSE(check_tool_frame(published_arm("puma560").kinematics, across));

  // A polar arm's tool centre point on no lever still has its slide; a SCARA of two turns needs one beyond
  // its elbow.
  JointChain scara;
  scara.count = 3;
  scara.axes[1].point_m = {0.3, 0.0, 0.0};
  scara.axes[2].kind = JointKind::kPrismatic;
  scara.zero_T_n.position_m = {0.3, 0.0, 0.0};
  scara.n_T_tool.position_m = {0.2, 0.0, 0.0};
  const Kinematics two = Kinematics::recognise(scara);
  ASSERT_EQ(two.follows(), Follows::kNone);
  EXPECT_FALSE(check_tool_frame(two, {{0.1, 0.0, 0.1}, {}}));
  const auto no_lever = check_tool_frame(two, {{0.0, 0.0, 0.1}, {}});
  ASSERT_TRUE(no_lever);
  EXPECT_EQ(no_lever->kind, Kind::kBadParameter);
  EXPECT_THAT(no_lever->text, HasSubstr("0.1 m from the flange"));
}

TEST(Solutions, OfASixAxisArmAreAllWithTheirNumbers) {
  const ArmModel arm = published_arm("puma560");
  PlanSettings settings;
  settings.tool_frame = Pose{{0.01, 0.02, 0.1}, about({1.0, 0.0, 0.0}, 0.3)};
  settings.base_frame = Pose{{5.0, 0.0, 1.0}, about({0.0, 1.0, 0.0}, 0.2)};
  const Kinematics framed = in_frames(arm.kinematics, settings);
  const Pose pose = framed.forward(kBent.position_q);
  const auto found = solutions_at(arm, settings, pose, kBent.position_q);
  ASSERT_TRUE(std::holds_alternative<std::vector<PoseSolution>>(found)) << std::get<PlanRefusal>(found).text;
  const auto& all = std::get<std::vector<PoseSolution>>(found);
  EXPECT_EQ(all.size(), 8u);
  const auto in_use = solution_in_use(arm, settings, kBent.position_q);
  ASSERT_TRUE(in_use);
  bool is_there = false;
  for (const PoseSolution& one : all) {
    const Pose back = framed.forward(one.joints_q);
    EXPECT_LT(test::distance(back.position_m, pose.position_m), 1e-12) << one.number;
    EXPECT_LT(angle_between(back.orientation, pose.orientation), 1e-12) << one.number;
    EXPECT_LT(one.orientation_error_rad, 1e-12);
    EXPECT_EQ(solution_in_use(arm, settings, one.joints_q), one.number);
    if (one.number != *in_use) continue;
    is_there = true;
    EXPECT_TRUE(one.in_range);
    for (std::size_t i = 0; i < 6; ++i) EXPECT_NEAR(one.joints_q[i], kBent.position_q[i], 1e-9);
  }
  EXPECT_TRUE(is_there);
}

TEST(Solutions, SayWhetherTheyAreWithinTheSoftLimits) {
  const ArmModel arm = lynx5();
  const Joints q{0.1, deg(40), deg(60), deg(-55)};
  const Pose pose = arm.kinematics.forward(q);
  const auto in_range = [&](const PlanSettings& settings) {
    int count = 0;
    const auto found = solutions_at(arm, settings, pose, q);
    for (const PoseSolution& one : std::get<std::vector<PoseSolution>>(found)) count += one.in_range;
    return count;
  };
  EXPECT_GE(in_range({}), 1);
  PlanSettings narrow;
  narrow.soft_limits.emplace();
  for (std::size_t i = 0; i < 4; ++i) {
    narrow.soft_limits->lower_q[i] = q[i] + 0.01;
    narrow.soft_limits->upper_q[i] = arm.joints[i].upper_q;
  }
  EXPECT_EQ(in_range(narrow), 0);
}

TEST(Solutions, HaveEachJointAtItsTurnWithinItsRangeWhateverTheOthersDo) {
  ArmModel arm = published_arm("puma560");
  const Pose pose = arm.kinematics.forward(kBent.position_q);
  const auto found = solutions_at(arm, {}, pose, kBent.position_q);
  for (const PoseSolution& one : std::get<std::vector<PoseSolution>>(found)) {
    ArmModel other = arm;  // whose joint 4 stands nowhere, and joint 0 a turn further
    other.joints[4] = {.lower_q = one.joints_q[4] + 0.1, .upper_q = one.joints_q[4] + 0.2};
    other.joints[0] = {.lower_q = one.joints_q[0] + 2.0 * std::numbers::pi - 0.1,
                       .upper_q = one.joints_q[0] + 2.0 * std::numbers::pi + 0.1};
    const auto turned = solutions_at(other, {}, pose, kBent.position_q);
    for (const PoseSolution& same : std::get<std::vector<PoseSolution>>(turned)) {
      if (same.number != one.number) continue;
      EXPECT_FALSE(same.in_range) << one.number;
      EXPECT_NEAR(same.joints_q[0], one.joints_q[0] + 2.0 * std::numbers::pi, 1e-12) << one.number;
      EXPECT_NEAR(same.joints_q[4], one.joints_q[4], 1e-12) << one.number;
    }
  }
}

TEST(Solutions, TellTheErrorOfAnOrientationThatTheArmCannotTake) {
  const ArmModel arm = published_arm("scara_gx4");
  const Joints q{0.2, 0.9, -0.05, 0.3};
  Pose pose = arm.kinematics.forward(q);
  pose.orientation = about({1.0, 0.0, 0.0}, 0.25) * pose.orientation;
  const auto found = solutions_at(arm, {}, pose, q);
  ASSERT_TRUE(std::holds_alternative<std::vector<PoseSolution>>(found)) << std::get<PlanRefusal>(found).text;
  const auto& all = std::get<std::vector<PoseSolution>>(found);
  EXPECT_EQ(all.size(), 2u);
  for (const PoseSolution& one : all) EXPECT_NEAR(one.orientation_error_rad, 0.25, 1e-9);
}

TEST(Solutions, BeyondReachAndWithoutAPoseAreRefused) {
  const ArmModel arm = published_arm("puma560");
  const auto kind_at = [&](const Pose& pose) {
    const auto found = solutions_at(arm, {}, pose, {});
    const auto* refusal = std::get_if<PlanRefusal>(&found);
    return refusal != nullptr ? std::optional(refusal->kind) : std::nullopt;
  };
  EXPECT_EQ(kind_at({{3.0, 0.0, 0.0}, {}}), Kind::kUnreachable);
  EXPECT_EQ(kind_at({{kNan, 0.0, 0.0}, {}}), Kind::kBadParameter);
  EXPECT_EQ(kind_at({{0.4, 0.1, 0.3}, {0.9, 0.0, 0.0, 0.0}}), Kind::kBadParameter);
}

TEST(Solutions, OfAnArmWithoutAClosedFormAreFoundAndHaveNoNumberInUse) {
  ArmModel arm = published_arm("puma560");
  arm.kinematics = Kinematics::other(arm.kinematics.chain());
  const Pose pose = arm.kinematics.forward(kBent.position_q);
  const auto found = solutions_at(arm, {}, pose, kBent.position_q);
  ASSERT_TRUE(std::holds_alternative<std::vector<PoseSolution>>(found)) << std::get<PlanRefusal>(found).text;
  EXPECT_EQ(std::get<std::vector<PoseSolution>>(found).size(), 8u);
  EXPECT_FALSE(solution_in_use(arm, {}, kBent.position_q));
}

}  // namespace
}  // namespace corbot::frames_test
