// SPDX-License-Identifier: Apache-2.0
// Motions keep the arm's parts to its workspace: every kind, between its ends, and from outside only inward.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <random>
#include <string>

#include "corbot/kinematics/arm_parts.h"
#include "planner/planner.h"
#include "planner/workspace_proof.h"
#include "support/test_arms.h"
#include "test_arm.h"

namespace corbot::workspace_test {
namespace {

using test::deg;
using test::lynx5;
using testing::HasSubstr;
using testing::StartsWith;

constexpr std::uint32_t kTool = bit_of(0), kWrist = bit_of(1), kElbow = bit_of(2);
constexpr std::uint32_t kLinks = bit_of(3) | bit_of(4) | bit_of(5);
const PlanStart kBent{{0.0, deg(40), deg(60), deg(55), 0.0, 0.0}, 0.0};

WorkspaceShape named(WorkspaceShape shape, const std::string& name) {
  name.copy(shape.name.data(), WorkspaceShape::kLongestName);
  return shape;
}
WorkspaceShape floor_at(double height_m, std::uint32_t parts = kTool | kWrist) {
  return named(plane_shape({{0, 0, 1}, height_m}, parts), "floor");
}

ArmModel arm_in(std::initializer_list<WorkspaceShape> shapes) {
  ArmModel arm = lynx5();
  for (const WorkspaceShape& shape : shapes) arm.workspace.shapes[arm.workspace.count++] = shape;
  return arm;
}

bool is_planned(const PlanResult& result) { return std::holds_alternative<std::vector<Command>>(result); }
std::string text_of(const PlanResult& result) {
  return is_planned(result) ? "planned" : std::get<PlanRefusal>(result).text;
}

/// Places the tool by a free motion without a workspace.
PlanStart at(const Vector3& tool_m, double pitch_deg) {
  PlanSettings settings;
  settings.tool_pitch_rad = deg(pitch_deg);
  const PlanResult result = Planner(lynx5()).move(kBent, settings, tool_m, 0.0);
  EXPECT_TRUE(is_planned(result)) << text_of(result);
  return {std::get<std::vector<Command>>(result).back().end_q, 0.0};
}

TEST(ArmParts, AreWhereTheAxesMeet) {
  const JointChain chain = lynx5().kinematics.chain();
  const ArmPoints parts = points_of(chain);
  const Joints q{0.3, deg(40), deg(60), deg(55), 0.0, 0.0};
  const auto states = part_states(chain, parts, q);
  const auto distance = [&](std::size_t a, std::size_t b) {
    return norm(states[a].position_m - states[b].position_m);
  };
  EXPECT_NEAR(distance(0, 1), 0.100, 1e-12);  // l3
  EXPECT_NEAR(distance(1, 2), 0.120, 1e-12);  // l2
  EXPECT_NEAR(norm(states[2].position_m - Vector3{0, 0, 0.067}), 0.120, 1e-12);
  EXPECT_NEAR(norm(states[0].position_m - forward(chain, q).position_m), 0.0, 1e-12);
}

TEST(ArmParts, OfASphericalWristIsItsCentre) {
  const ArmModel puma = test::arm_of("puma560");
  const ArmPoints parts = points_of(puma.kinematics.chain());
  ASSERT_TRUE(parts[1].exists && parts[2].exists);
  Joints q{0.1, 0.2, 0.3, 0.4, 0.5, 0.6};
  const Vector3 wrist_m = part_states(puma.kinematics.chain(), parts, q)[1].position_m;
  q[3] = q[4] = q[5] = -0.7;
  EXPECT_NEAR(norm(part_states(puma.kinematics.chain(), parts, q)[1].position_m - wrist_m), 0.0, 1e-12);
}

TEST(ArmParts, OfSlidesAreTheToolAlone) {
  const ArmPoints parts = points_of(test::arm_of("cartesian_ppp").kinematics.chain());
  EXPECT_TRUE(parts[0].exists);
  EXPECT_FALSE(parts[1].exists || parts[2].exists);
}

TEST(ArmParts, LinksAreBetweenThePoints) {
  const auto links = [](const char* name) {
    const ArmParts parts = parts_of(points_of(test::arm_of(name).kinematics.chain()));
    return std::array{parts[3].exists, parts[4].exists, parts[5].exists};
  };
  EXPECT_EQ(links("puma560"), (std::array{true, true, true}));
  EXPECT_EQ(links("polar_rrp"), (std::array{true, true, false}))
      << "without a wrist the forearm has the tool";
  EXPECT_EQ(links("cartesian_ppp"), (std::array{false, false, false}));
  const JointChain chain = lynx5().kinematics.chain();
  const auto states = part_states(chain, points_of(chain), kBent.position_q);
  EXPECT_NEAR(norm(states[3].position_m - Vector3{0, 0, 0.067}), 0.0, 1e-12);
}

TEST(Shape, TheClearanceOfASegmentIsTheLeastOfItsPoints) {
  std::mt19937_64 random(7);
  std::uniform_real_distribution<double> place(-1.0, 1.0);
  int inside = 0, off_ends = 0;
  for (int i = 0; i < 3000; ++i) {
    const Vector3 from{place(random), place(random), place(random)};
    const Vector3 to{place(random), place(random), place(random)};
    const Vector3 half{0.3, 0.2 + 0.1 * place(random), 0.25};
    const auto kind = i % 4 == 0 ? ShapeKind::kInside : ShapeKind::kOutside;
    const WorkspaceShape shape = box_shape(kind, -1.0 * half, half, 0);
    double dense_m = 1e9;
    constexpr int kPoints = 1000;
    for (int k = 0; k <= kPoints; ++k) {
      const double at = static_cast<double>(k) / kPoints;
      dense_m = std::min(dense_m, clearance_m(shape, from + at * (to - from)));
    }
    const double found_m = clearance_m(shape, from, to);
    EXPECT_LE(found_m, dense_m + 1e-12) << i;
    EXPECT_GE(found_m, dense_m - norm(to - from) / kPoints) << i;
    inside += kind == ShapeKind::kOutside && found_m < 0.0 ? 1 : 0;
    off_ends += found_m < std::min(clearance_m(shape, from), clearance_m(shape, to)) - 1e-3 ? 1 : 0;
  }
  EXPECT_GT(inside, 100);
  EXPECT_GT(off_ends, 100);
}

TEST(ArmParts, HaveTheDerivativesOfTheirPlaces) {
  for (const char* name : test::kTestArms) {
    const ArmModel arm = test::arm_of(name);
    const JointChain& chain = arm.kinematics.chain();
    const ArmPoints parts = points_of(chain);
    Joints q{};
    for (std::size_t i = 0; i < arm.dof; ++i)
      q[i] = 0.4 * arm.joints[i].lower_q + 0.6 * arm.joints[i].upper_q;
    const auto now = part_states(chain, parts, q);
    for (std::size_t i = 0; i < arm.dof; ++i) {
      constexpr double kStep = 1e-6;
      Joints a = q, b = q;
      a[i] -= kStep;
      b[i] += kStep;
      const auto before = part_states(chain, parts, a), after = part_states(chain, parts, b);
      for (std::size_t k = 0; k < kArmPoints; ++k) {
        const Vector3 slope = (0.5 / kStep) * (after[k].position_m - before[k].position_m);
        EXPECT_NEAR(norm(slope - now[k].per_q[i]), 0.0, 1e-8) << name << " " << k << " " << i;
      }
    }
  }
}

TEST(Workspace, TheHandDoesNotGoThroughTheTable) {
  PlanSettings down;
  down.tool_pitch_rad = deg(-80);
  const Vector3 target{0.2, 0.0, -0.06};
  EXPECT_TRUE(is_planned(Planner(lynx5()).move(kBent, down, target, 0.0)));
  const PlanResult result = Planner(arm_in({floor_at(0.0)})).move(kBent, down, target, 0.0);
  ASSERT_FALSE(is_planned(result));
  const auto& refusal = std::get<PlanRefusal>(result);
  EXPECT_EQ(refusal.kind, PlanRefusal::Kind::kLimitExceeded);
  EXPECT_THAT(refusal.text, StartsWith("the tool would be 60 mm below 'floor' at 100 % of the path ("));
  EXPECT_EQ(refusal.parameter, "workspace: " + refusal.text);
  EXPECT_NEAR(refusal.value, -0.06, 1e-9);
  EXPECT_NEAR(norm(refusal.target_m - target), 0.0, 1e-9);
}

TEST(Workspace, AMotionIsRefusedForItsMiddle) {
  // The elbow swings over the top: both ends lie below the ceiling.
  const WorkspaceShape ceiling = named(plane_shape({{0, 0, -1}, -0.18}, kElbow), "ceiling");
  Joints there = kBent.position_q;
  there[1] = deg(125);
  const PlanResult result = Planner(arm_in({ceiling})).move_joints(kBent, {}, there, 0.0);
  ASSERT_FALSE(is_planned(result));
  const auto& refusal = std::get<PlanRefusal>(result);
  EXPECT_NEAR(refusal.value, 0.18 - 0.187, 1e-4);
  EXPECT_THAT(refusal.text, StartsWith("the elbow would be 7 mm beyond 'ceiling' at "));
  EXPECT_TRUE(is_planned(Planner(arm_in({})).move_joints(kBent, {}, there, 0.0)));
  there[1] = deg(45);
  EXPECT_TRUE(is_planned(Planner(arm_in({ceiling})).move_joints(kBent, {}, there, 0.0)));
}

TEST(Workspace, LinesAndArcsAreRefusedForTheirMiddle) {
  const PlanStart start = at({0.2, -0.08, 0.06}, -60);
  PlanSettings settings;
  settings.tool_pitch_rad = deg(-60);
  const WorkspaceShape post =
      named(box_shape(ShapeKind::kOutside, {0.15, -0.01, 0.0}, {0.21, 0.01, 0.1}, kTool), "post");
  const Planner free(lynx5()), kept(arm_in({post}));
  const Vector3 to{0.2, 0.08, 0.06};
  EXPECT_TRUE(is_planned(free.move_s(start, settings, to, 0.0)));
  EXPECT_THAT(text_of(kept.move_s(start, settings, to, 0.0)),
              StartsWith("the tool would be 10 mm inside 'post' at 50"));
  const Vector3 here{0.2, -0.08, 0.06};
  EXPECT_THAT(text_of(kept.move_c(start, settings, here, {0.205, 0.0, 0.06}, to)),
              HasSubstr("inside 'post'"));
  EXPECT_EQ(text_of(kept.move_c(start, settings, here, {0.22, 0.0, 0.06}, to)), "planned");
}

TEST(Workspace, ALineMayRunAlongAFloor) {
  const PlanStart start = at({0.2, -0.08, 0.05}, -60);
  PlanSettings settings;
  settings.tool_pitch_rad = deg(-60);
  const Vector3 to{0.2, 0.08, 0.05};
  EXPECT_EQ(text_of(Planner(arm_in({floor_at(0.05)})).move_s(start, settings, to, 0.0)), "planned");
  EXPECT_THAT(
      text_of(Planner(arm_in({floor_at(0.05)})).move_s(start, settings, to - Vector3{0, 0, 2e-6}, 0.0)),
      HasSubstr("the tool would be 0.002 mm below 'floor'"));
}

TEST(Workspace, FromOutsideTheArmMayOnlyMoveBack) {
  const PlanStart below = at({0.2, 0.0, -0.02}, -60);
  PlanSettings settings;
  settings.tool_pitch_rad = deg(-60);
  const Planner kept(arm_in({floor_at(0.0)}));
  EXPECT_EQ(text_of(kept.move_s(below, settings, {0.2, 0.0, 0.02}, 0.0)), "planned");
  EXPECT_EQ(text_of(kept.move_s(below, settings, {0.2, 0.0, -0.01}, 0.0)), "planned");
  EXPECT_THAT(
      text_of(kept.move_s(below, settings, {0.2, 0.0, -0.03}, 0.0)),
      testing::AllOf(StartsWith("the tool would be 30 mm below 'floor' at 100 % of the path (0.01 m)"),
                     HasSubstr("; it stands at 20 mm and may only move back")));
}

TEST(Workspace, AMotionToAPointTakesAnotherSolutionIfThePresentOneIsRefused) {
  // The elbow is up. Under a ceiling for the elbow the arm bends the other way.
  ArmModel arm = test::wide_arm();
  const PlanStart start{{0.0, deg(10), deg(30), deg(35), 0.0, 0.0}, 0.0};
  PlanSettings settings;
  settings.tool_pitch_rad = tool_pose(arm.kinematics, start.position_q).pitch_rad;
  const Vector3 target = arm.kinematics.forward(start.position_q).position_m - Vector3{0.05, 0.0, 0.0};
  const auto end_of = [&] {
    const PlanResult result = Planner(arm).move(start, settings, target, 0.0);
    EXPECT_EQ(text_of(result), "planned");
    return std::get<std::vector<Command>>(result).back().end_q;
  };
  const auto elbow_m = [&](const Joints& q) {
    const JointChain& chain = arm.kinematics.chain();
    return part_states(chain, points_of(chain), q)[2].position_m[2];
  };
  const Joints free_q = end_of();
  const double ceiling_m = 0.5 * (elbow_m(start.position_q) + elbow_m(free_q));
  ASSERT_GT(elbow_m(free_q), ceiling_m);
  arm.workspace.shapes[arm.workspace.count++] =
      named(plane_shape({{0, 0, -1}, -ceiling_m}, kElbow), "ceiling");
  const Joints kept_q = end_of();
  EXPECT_LT(elbow_m(kept_q), ceiling_m);
  EXPECT_NEAR(norm(arm.kinematics.forward(kept_q).position_m - target), 0.0, 1e-9);
}

TEST(Workspace, TheToolFrameAndTheBaseFrameCount) {
  const PlanStart start = at({0.2, 0.0, 0.03}, -90);
  const Planner kept(arm_in({floor_at(0.0)}));
  EXPECT_EQ(text_of(kept.drive(start, {}, 0, 0.5, deg(20))), "planned");
  PlanSettings longer;
  longer.tool_frame = lynx5().kinematics.chain().n_T_tool;
  longer.tool_frame->position_m[0] += 0.05;
  EXPECT_THAT(text_of(kept.drive(start, longer, 1, deg(-5), deg(20))),
              HasSubstr("it stands at 20 mm and may"));
  PlanSettings lower, higher;
  lower.base_frame = Pose{{0, 0, -0.05}, {}};
  higher.base_frame = Pose{{0, 0, 0.5}, {}};
  EXPECT_THAT(text_of(kept.drive(start, lower, 1, deg(-5), deg(20))), HasSubstr("below 'floor'"));
  EXPECT_EQ(text_of(kept.drive(start, higher, 1, deg(-5), deg(20))), "planned");
}

TEST(Workspace, AnArmThatStandsWithinTheToleranceMayMoveBack) {
  const PlanStart start = at({0.2, 0.0, 0.05}, -60);
  PlanSettings settings;
  settings.tool_pitch_rad = deg(-60);
  const Planner kept(arm_in({floor_at(0.05 + 0.8e-6)}));
  EXPECT_EQ(text_of(kept.move_s(start, settings, {0.2, 0.0, 0.08}, 0.0)), "planned");
}

TEST(Workspace, MotionsDoNotAddUpTheirTolerance) {
  const ArmModel free = lynx5();
  const ArmParts parts = parts_of(points_of(free.kinematics.chain()));
  const auto height_m = [&](const Joints& q) {
    return part_states(free.kinematics.chain(), points_of(free.kinematics.chain()), q)[parts[0].from]
        .position_m[2];
  };
  const ArmModel arm = arm_in({floor_at(height_m(kBent.position_q) + 0.8e-6, kTool)});
  Joints turned = kBent.position_q;
  turned[3] += 3e-6;
  const double down = height_m(turned) < height_m(kBent.position_q) ? 1.0 : -1.0;
  EXPECT_THAT(text_of(Planner(arm).drive(kBent, {}, 3, down * 3e-6, deg(20))),
              HasSubstr("may only move back"));
  EXPECT_EQ(text_of(Planner(arm).drive(kBent, {}, 3, -down * 3e-6, deg(20))), "planned");
  EXPECT_EQ(text_of(Planner(arm).drive(kBent, {}, 0, deg(5), deg(20))), "planned") << "it stays as deep";
}

TEST(Workspace, ShippedArmsOnATableHaveAFloorAboveWhichTheyAreReady) {
  for (const char* name : {"lynx5", "lynx5-can", "al5d", "al5d_wr", "omx", "px100", "so101"}) {
    const ArmModel arm = load_profile(std::string(CORBOT_PROFILES) + "/" + name + ".toml").arm;
    ASSERT_EQ(arm.workspace.count, 1u) << name;
    EXPECT_EQ(arm.workspace.shapes[0].parts, kTool | kWrist) << name;
    const JointChain& chain = arm.kinematics.chain();
    for (const PartState& part : part_states(chain, points_of(chain), {}))
      EXPECT_GE(clearance_m(arm.workspace.shapes[0], part.position_m), 0.0) << name;
    EXPECT_EQ(test::arm_of(name).workspace.count, 0u) << "tests go below: " << name;
  }
}

TEST(Workspace, AnArmThatHasSunkOntoTheTableGetsReady) {
  const ArmModel arm = load_profile(std::string(CORBOT_PROFILES) + "/lynx5.toml").arm;
  const PlanStart sunk{{0.3, deg(-30), 0.0, deg(-20), 0.0, 0.0}, 0.0};
  ASSERT_LT(arm.kinematics.forward(sunk.position_q).position_m[2], -0.05);
  EXPECT_EQ(text_of(Planner(arm).move_joints(sunk, {}, {}, 0.0)), "planned");
  EXPECT_THAT(text_of(Planner(arm).drive(sunk, {}, 3, deg(-10), deg(20))), HasSubstr("may only move back"));
}

TEST(Workspace, ALinkDoesNotPassThroughABoxThatItsEndsMiss) {
  Joints there = kBent.position_q, at_post = kBent.position_q;
  there[0] = deg(60);
  at_post[0] = deg(30);
  const JointChain chain = lynx5().kinematics.chain();
  const auto states = part_states(chain, points_of(chain), at_post);
  const Vector3 middle = 0.5 * (states[1].position_m + states[2].position_m), half{0.01, 0.01, 0.01};
  const auto post = [&](std::uint32_t parts) {
    return named(box_shape(ShapeKind::kOutside, middle - half, middle + half, parts), "post");
  };
  EXPECT_EQ(text_of(Planner(arm_in({post(kTool | kWrist | kElbow)})).move_joints(kBent, {}, there, 0.0)),
            "planned");
  ArmModel arm = arm_in({post(kLinks)});
  arm.workspace.link_radius_m = {0.02, 0.02, 0.02};
  const PlanResult result = Planner(arm).move_joints(kBent, {}, there, 0.0);
  EXPECT_THAT(text_of(result), StartsWith("the forearm would be 30 mm inside 'post' at 50 % of the path ("));
  EXPECT_NEAR(std::get<PlanRefusal>(result).value, -0.03, 1e-4);
  there[0] = deg(10);
  EXPECT_EQ(text_of(Planner(arm).move_joints(kBent, {}, there, 0.0)), "planned");
}

TEST(Workspace, TheRadiusOfALinkCounts) {
  const PlanStart start = at({0.2, -0.05, 0.05}, -60);
  PlanSettings settings;
  settings.tool_pitch_rad = deg(-60);
  ArmModel arm = arm_in({floor_at(0.0, bit_of(5))});
  const Vector3 to{0.2, 0.05, 0.05};
  arm.workspace.link_radius_m[2] = 0.05;
  EXPECT_EQ(text_of(Planner(arm).move_s(start, settings, to, 0.0)), "planned");
  EXPECT_THAT(text_of(Planner(arm).move_s(start, settings, to - Vector3{0, 0, 0.015}, 0.0)),
              StartsWith("the hand would be 15 mm below 'floor' at 100 % of the path"));
}

TEST(Workspace, ABoxToStayInHoldsEveryPartThatItNames) {
  const WorkspaceShape cage =
      named(box_shape(ShapeKind::kInside, {-0.4, -0.05, 0.0}, {0.4, 0.05, 0.4}, kTool | kElbow), "cage");
  const Planner kept(arm_in({cage}));
  Joints there = kBent.position_q;
  there[0] = deg(60);
  EXPECT_THAT(text_of(kept.move_joints(kBent, {}, there, 0.0)), HasSubstr("outside 'cage'"));
  EXPECT_THAT(text_of(kept.drive(kBent, {}, 0, deg(60), deg(30))), HasSubstr("outside 'cage'"));
  there[0] = deg(5);
  EXPECT_EQ(text_of(kept.move_joints(kBent, {}, there, 0.0)), "planned");
}

}  // namespace
}  // namespace corbot::workspace_test
