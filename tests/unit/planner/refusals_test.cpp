// SPDX-License-Identifier: Apache-2.0
// Every way in which a motion is refused: the kind, what is at fault, and that the text can be read.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>

#include "planner/planner.h"
#include "test_arm.h"

namespace corbot::refusals_test {
namespace {

using test::deg;
using test::lynx5;
using test::wide_arm;
using ::testing::HasSubstr;
using Kind = PlanRefusal::Kind;
using Point = std::array<double, 3>;

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kInf = std::numeric_limits<double>::infinity();
const std::vector<double> kNotNumbers{kNan, kInf, -kInf, 1e308, -1e308};

/// Somewhere comfortable: hand level, elbow bent.
const PlanStart kBent{{0.1, deg(40), deg(60), deg(55), 0.0, 0.0}, 0.0};
const Point kGood{0.22, 0.02, 0.12};

void expect_refused(const PlanResult& result, Kind kind, const std::string& parameter,
                    const std::string& text) {
  ASSERT_TRUE(std::holds_alternative<PlanRefusal>(result)) << "planned: " << parameter;
  const auto& refusal = std::get<PlanRefusal>(result);
  EXPECT_EQ(refusal.kind, kind) << refusal.text;
  EXPECT_EQ(refusal.parameter, parameter) << refusal.text;
  EXPECT_THAT(refusal.text, HasSubstr(text));
  EXPECT_LT(refusal.text.size(), 192u) << refusal.text;  // what the C interface holds
}

const PlanRefusal& refusal_of(const PlanResult& result) { return std::get<PlanRefusal>(result); }

TEST(PlanRefusals, TheComfortablePoseIsNotRefused) {
  const Planner planner(lynx5());
  EXPECT_TRUE(std::holds_alternative<std::vector<Command>>(planner.move(kBent, {}, kGood, 0.0)));
  EXPECT_TRUE(std::holds_alternative<std::vector<Command>>(planner.move_s(kBent, {}, kGood, 0.0)));
  EXPECT_TRUE(std::holds_alternative<std::vector<Command>>(
      planner.move_c(kBent, {}, kGood, {0.22, 0.04, 0.14}, {0.22, 0.06, 0.12})));
}

TEST(PlanRefusals, CoordinatesThatAreNotNumbers) {
  const Planner planner(lynx5());
  for (const double bad : kNotNumbers) {
    for (std::size_t i = 0; i < 3; ++i) {
      Point p = kGood;
      p[i] = bad;
      expect_refused(planner.move(kBent, {}, p, 0.0), Kind::kBadParameter, "P", "of P is");
      expect_refused(planner.move_s(kBent, {}, p, 0.0), Kind::kBadParameter, "P", "of P is");
      expect_refused(planner.move_c(kBent, {}, p, kGood, kGood), Kind::kBadParameter, "P1", "of P1 is");
      expect_refused(planner.move_c(kBent, {}, kGood, p, kGood), Kind::kBadParameter, "P2", "of P2 is");
      expect_refused(planner.move_c(kBent, {}, kGood, kGood, p), Kind::kBadParameter, "P3", "of P3 is");
    }
  }
}

TEST(PlanRefusals, TimesThatAreNotTimes) {
  const Planner planner(lynx5());
  for (const double bad : {kNan, kInf, -kInf, 1e308, -1.0, -1e-300, 3600.1}) {
    expect_refused(planner.move(kBent, {}, kGood, bad), Kind::kBadParameter, "t", "allowed 0 to 3600 s");
    expect_refused(planner.move_s(kBent, {}, kGood, bad), Kind::kBadParameter, "t", "allowed 0 to 3600 s");
    expect_refused(planner.move_joints(kBent, {}, {}, bad), Kind::kBadParameter, "t", "allowed 0 to 3600 s");
    expect_refused(planner.dwell(kBent, bad), Kind::kBadParameter, "t", "allowed 0 to 3600 s");
  }
}

TEST(PlanRefusals, TooFarAndTooClose) {
  const Planner planner(lynx5());
  for (const auto& result :
       {planner.move(kBent, {}, {0.5, 0.1, 0.1}, 0.0), planner.move_s(kBent, {}, {0.5, 0.1, 0.1}, 0.0)}) {
    expect_refused(result, Kind::kUnreachable, "P", "too far");
    EXPECT_EQ(refusal_of(result).target_m, (Point{0.5, 0.1, 0.1}));
    EXPECT_NEAR(refusal_of(result).upper, 0.24, 1e-15);
    EXPECT_GT(refusal_of(result).value, 0.24);
  }
  // Inside the base, with links of unequal length: the wrist cannot come that near to the shoulder.
  ArmModel al5d = wide_arm();
  al5d.kinematics = test::four_axis(0.067, 0.14605, 0.187325, 0.100);
  PlanSettings up;
  up.tool_pitch_rad = deg(90);
  expect_refused(Planner(al5d).move(kBent, up, {0.0, 0.0, 0.167}, 0.0), Kind::kUnreachable, "P", "too close");
}

TEST(PlanRefusals, InsideTheBaseTheRangesForbid) {
  const PlanResult result = Planner(lynx5()).move(kBent, {}, {0.02, 0.0, 0.05}, 0.0);
  ASSERT_TRUE(std::holds_alternative<PlanRefusal>(result));
  EXPECT_EQ(refusal_of(result).kind, Kind::kLimitExceeded);
  EXPECT_EQ(refusal_of(result).parameter, "joint range");
  EXPECT_GE(refusal_of(result).joint, 0);
  EXPECT_THAT(refusal_of(result).text, HasSubstr("degrees at the target, allowed"));
}

TEST(PlanRefusals, BehindTheRangeOfTheBase) {
  ArmModel arm = lynx5();
  arm.joints[2].lower_q = 0.0;
  const Point behind{-0.25, 0.01, 0.1};
  for (const auto& result :
       {Planner(arm).move(kBent, {}, behind, 0.0), Planner(arm).move_s(kBent, {}, behind, 0.0)}) {
    expect_refused(result, Kind::kLimitExceeded, "joint range", "joint 0 would be at");
    EXPECT_EQ(refusal_of(result).joint, 0);
    EXPECT_NEAR(refusal_of(result).upper, deg(90), 1e-15);
    EXPECT_GT(refusal_of(result).value, deg(90));
  }
}

TEST(PlanRefusals, ALineWhoseMiddleIsOutOfReach) {
  // A chord across the hole about the shoulder that unequal links leave.
  ArmModel arm = wide_arm();
  arm.kinematics = test::four_axis(0.067, 0.14605, 0.187325, 0.100);
  const Point from{0.12, 0.0, 0.067 + 0.08}, to{0.12, 0.0, 0.067 - 0.08};
  const IkSolution ik = test::inverse_at_pitch(arm.kinematics, from, 0.0, 0, {});
  ASSERT_EQ(ik.status, IkStatus::kOk);
  const PlanResult result = Planner(arm).move_s({ik.joints_q, 0.0}, {}, to, 0.0);
  expect_refused(result, Kind::kUnreachable, "P", "the path's point");
  EXPECT_NEAR(refusal_of(result).target_m[2], 0.067, 0.04);
  // Its end alone is no obstacle.
  EXPECT_TRUE(
      std::holds_alternative<std::vector<Command>>(Planner(arm).move({ik.joints_q, 0.0}, {}, to, 0.0)));
}

TEST(PlanRefusals, ALineWhoseMiddleLeavesARange) {
  // From one side of the base to the other, past the axis on the far side of it.
  ArmModel arm = lynx5();
  arm.joints[2] = {deg(-160), deg(160), deg(150), deg(800), deg(8000)};
  arm.joints[1] = {deg(-160), deg(160), deg(150), deg(800), deg(8000)};
  arm.joints[3] = {deg(-170), deg(170), deg(200), deg(1000), deg(8000)};
  PlanSettings settings;
  const auto joints_at = [&arm](const Point& p) {
    return test::inverse_at_pitch(arm.kinematics, p, 0.0, 0, {});
  };
  const Point left{0.001, 0.2, 0.1}, right{0.001, -0.2, 0.1};
  ASSERT_EQ(joints_at(left).status, IkStatus::kOk);
  const PlanResult result = Planner(arm).move_s({joints_at(left).joints_q, 0.0}, settings, right, 0.0);
  ASSERT_TRUE(std::holds_alternative<PlanRefusal>(result));
  EXPECT_EQ(refusal_of(result).kind, Kind::kLimitExceeded) << refusal_of(result).text;
  EXPECT_THAT(refusal_of(result).text, HasSubstr("% along the path"));
}

TEST(PlanRefusals, AHalfTurnThatEndsAPathIsNamed) {
  const auto about_base = [](double range_deg) {
    ArmModel arm = wide_arm();
    arm.joints[0].lower_q = deg(-range_deg);
    arm.joints[0].upper_q = deg(range_deg);
    const auto at = [&](double base_deg) {
      Joints q = kBent.position_q;
      q[0] = deg(base_deg);
      return test::tcp_of(arm, q);
    };
    PlanStart start = kBent;
    start.position_q[0] = 0.0;
    PlanSettings settings;
    const double elevation_rad = arm.kinematics.followed().at(start.position_q)[0];
    settings.tool_pitch_rad = pitch_of_angle(arm.kinematics, elevation_rad);
    return Planner(arm).move_c(start, settings, at(0), at(150), at(300));
  };
  const PlanResult wide = about_base(360);
  expect_refused(
      wide, Kind::kLimitExceeded, "joint range",
      "allowed -180 to 180 degrees; its range is wider, but one such path keeps a joint within half a "
      "turn of 0 degrees: divide the path");
  EXPECT_NEAR(refusal_of(wide).upper, deg(180), 1e-5);
  const PlanResult narrow = about_base(170);
  expect_refused(narrow, Kind::kLimitExceeded, "joint range", "allowed -170 to 170 degrees");
  EXPECT_THAT(refusal_of(narrow).text, testing::Not(HasSubstr("half a turn")));
}

TEST(PlanRefusals, ArcsThatAreNone) {
  const Planner planner(lynx5());
  const Point a{0.2, 0.0, 0.1}, b{0.21, 0.02, 0.12}, middle{0.205, 0.01, 0.11};
  expect_refused(planner.move_c(kBent, {}, a, a, b), Kind::kBadParameter, "P2", "P1 and P2 are 0 m apart");
  expect_refused(planner.move_c(kBent, {}, a, b, b), Kind::kBadParameter, "P3", "P2 and P3 are 0 m apart");
  expect_refused(planner.move_c(kBent, {}, a, b, a), Kind::kBadParameter, "P3", "P1 and P3 are 0 m apart");
  expect_refused(planner.move_c(kBent, {}, a, {0.2, 0.0, 0.1 + 5e-10}, b), Kind::kBadParameter, "P2",
                 "apart");
  expect_refused(planner.move_c(kBent, {}, a, middle, b), Kind::kBadParameter, "P2",
                 "P1, P2 and P3 lie on a line");
  expect_refused(planner.move_c(kBent, {}, a, {0.205 + 1e-9, 0.01, 0.11}, b), Kind::kBadParameter, "P2",
                 "on a line");
  // The planner gives neither of two commands when the second is impossible: P1 is within reach, the arc's
  // far side is not.
  expect_refused(planner.move_c(kBent, {}, {0.25, 0.1, 0.1}, {0.4, 0.0, 0.1}, {0.25, -0.1, 0.1}),
                 Kind::kUnreachable, "P", "too far");
}

TEST(PlanRefusals, Drive) {
  const Planner planner(lynx5());
  for (const int joint : {-1, 4, 6, 1'000'000, -2'147'483'647}) {
    expect_refused(planner.drive(kBent, {}, joint, 0.1, 0.1), Kind::kBadParameter, "articulation", "0 to 3");
  }
  for (const double bad : {kNan, kInf, -kInf}) {
    expect_refused(planner.drive(kBent, {}, 0, bad, 0.1), Kind::kBadParameter, "increment", "not a finite");
    expect_refused(planner.drive(kBent, {}, 0, 0.1, bad), Kind::kBadParameter, "speed", "allowed above 0");
  }
  for (const double bad : {0.0, -0.1}) {
    expect_refused(planner.drive(kBent, {}, 0, 0.1, bad), Kind::kBadParameter, "speed", "allowed above 0");
  }
  PlanSettings half;
  half.joint_speed_ratio[0] = 0.5;
  expect_refused(planner.drive(kBent, {}, 0, 0.1, deg(181)), Kind::kLimitExceeded, "speed", "up to 180");
  expect_refused(planner.drive(kBent, half, 0, 0.1, deg(91)), Kind::kLimitExceeded, "speed", "up to 90");
  expect_refused(planner.drive(kBent, {}, 0, 0.1, 1e308), Kind::kLimitExceeded, "speed", "up to 180");
  expect_refused(planner.drive(kBent, {}, 0, deg(90), 0.1), Kind::kLimitExceeded, "joint range", "joint 0");
  expect_refused(planner.drive(kBent, {}, 3, -1e308, 0.1), Kind::kLimitExceeded, "joint range", "joint 3");
  expect_refused(planner.drive(kBent, {}, 0, 0.1, 1e-9), Kind::kLimitExceeded, "duration",
                 "allowed up to 3600 s");
}

TEST(PlanRefusals, MotionsThatWouldLastMoreThanAnHour) {
  PlanSettings crawl;
  crawl.speed_ratio = 1e-6;
  const Planner planner(lynx5());
  expect_refused(planner.move(kBent, crawl, kGood, 0.0), Kind::kLimitExceeded, "duration", "up to 3600 s");
  expect_refused(planner.move_s(kBent, crawl, kGood, 0.0), Kind::kLimitExceeded, "duration", "up to 3600 s");
}

TEST(PlanRefusals, JointsGripperAndPitch) {
  const Planner planner(lynx5());
  for (const double bad : {kNan, kInf, -kInf}) {
    expect_refused(planner.move_joints(kBent, {}, {0, bad, 0, 0, 0, 0}, 0.0), Kind::kBadParameter, "angle",
                   "joint 1");
    PlanSettings pitched;
    pitched.tool_pitch_rad = bad;
    expect_refused(planner.move(kBent, pitched, kGood, 0.0), Kind::kBadParameter, "tool pitch", "finite");
    expect_refused(planner.move_s(kBent, pitched, kGood, 0.0), Kind::kBadParameter, "tool pitch", "finite");
  }
  expect_refused(planner.move_joints(kBent, {}, {0, 0, deg(131), 0, 0, 0}, 0.0), Kind::kLimitExceeded,
                 "joint range", "joint 2 would be at 131 degrees at the target, allowed -30 to 130 degrees");
  for (const double bad : {kNan, kInf, -kInf, -1e-9, 1.0 + 1e-9}) {
    expect_refused(planner.gripper(kBent, bad), Kind::kBadParameter, "opening", "allowed 0 to 1");
  }
}

TEST(PlanRefusals, OfAnArmWithoutAClosedFormSayHowFarItCanBeFollowed) {
  ArmModel arm = lynx5();
  arm.kinematics = Kinematics::other(arm.kinematics.chain());
  const Planner planner(arm);
  const auto here = test::tcp_of(arm, kBent.position_q);
  const std::array<double, 3> far{here[0] + 0.5, here[1], here[2]};
  expect_refused(planner.move(kBent, {}, far, 0.0), Kind::kUnreachable, "P",
                 "no joints are found for the target");
  const PlanResult line = planner.move_s(kBent, {}, far, 0.0);
  expect_refused(line, Kind::kUnreachable, "P", "% of it, beyond which the path leaves the arm's reach");
  EXPECT_GT(refusal_of(line).target_m[0], here[0]);
  EXPECT_LT(refusal_of(line).target_m[0], far[0]);
  // The base axis is along joint 0's: nothing turns joint 0 fast enough.
  expect_refused(planner.move_s(kBent, {}, {-here[0], -here[1], here[2]}, 0.0), Kind::kUnreachable, "P",
                 "singularity");
  // Stretched, as lynx5 is where all joints are zero.
  expect_refused(planner.move_s({}, {}, kGood, 0.0), Kind::kUnreachable, "P", "at a singularity");
  ArmModel two = arm;
  JointChain chain = arm.kinematics.chain();
  two.dof = chain.count = 2;
  two.kinematics = Kinematics::other(chain);
  expect_refused(Planner(two).move_s(kBent, {}, kGood, 0.0), Kind::kUnreachable, "kind",
                 "an arm of 2 joints follows no lines and arcs");
  PlanSettings turned;
  turned.tool_orientation = Quaternion{0.0, 1.0, 0.0, 0.0};
  expect_refused(planner.move(kBent, turned, here, 0.0), Kind::kUnreachable, "P", "degrees away");
  expect_refused(planner.move_s(kBent, turned, here, 0.0), Kind::kUnreachable, "P", "degrees away");
}

TEST(PlanRefusals, ALineFromWhereNoLineCanBegin) {
  ArmModel arm = wide_arm();
  PlanStart beyond = kBent;
  beyond.position_q[0] = deg(181);  // taken for -179 degrees
  const PlanResult result = Planner(arm).move_s(beyond, {}, {-0.2, 0.05, 0.1}, 0.0);
  expect_refused(result, Kind::kLimitExceeded, "joint range", "move its joints first");
  EXPECT_EQ(refusal_of(result).joint, 0);
}

TEST(PlanRefusals, NotALineBeyondHalfATurnInARangeThatGoesThere) {
  ArmModel arm = wide_arm();
  arm.joints[0].upper_q = deg(270);
  PlanStart turned = kBent;
  turned.position_q[0] = deg(200);
  const PlanResult result = Planner(arm).move_s(turned, {}, {-0.2, -0.05, 0.1}, 0.0);
  ASSERT_TRUE(std::holds_alternative<std::vector<Command>>(result)) << refusal_of(result).text;
  EXPECT_NEAR(std::get<std::vector<Command>>(result).front().end_q[0], deg(180) + std::atan2(0.05, 0.2),
              1e-9);
}

}  // namespace
}  // namespace corbot::refusals_test
