// SPDX-License-Identifier: Apache-2.0
#include "sim/scene/arm_body.h"

#include <gtest/gtest.h>

#include <random>
#include <string>

#include <Eigen/Geometry>

#include "config/load_profile.h"
#include "corbot/units.h"
#include "support/paths.h"

namespace corbot::sim {
namespace {

using Eigen::Vector3d;

const ArmModel& lynx5() {
  static const ArmModel model = load_profile(std::string(CORBOT_PROFILES) + "/lynx5.toml").arm;
  return model;
}

ArmModel cell_scara() {
  std::string text = read_profile_text(CORBOT_CELL "/scara.toml");
  text.replace(text.find("SCENE/NAME"), 10, "/x");
  return parse_profile(text, "scara.toml").arm;
}

Joints random_joints(const ArmModel& model, std::mt19937& random) {
  Joints q{};
  for (std::size_t k = 0; k < model.dof; ++k)
    q[k] = std::uniform_real_distribution<double>(model.joints[k].lower_q, model.joints[k].upper_q)(random);
  return q;
}

/// Returns the servos' positions for these joints.
ArmBody body_at(const ArmModel& model, const ArmBase& base, const Joints& q, double gripper_us) {
  return arm_body(model, base, 0.032, [&](std::size_t channel) {
    for (std::size_t i = 0; i < model.dof; ++i) {
      const ServoMap& servo = model.servos[i];
      if (servo.channel == channel) return servo.zero_us + servo.direction * servo.us_per_q * q[i];
    }
    return channel == model.gripper.channel ? gripper_us : 0.0;
  });
}

TEST(ArmBody, IsWhereTheRobotsOwnKinematicsHaveIt) {
  const unsigned seed = std::random_device{}();
  SCOPED_TRACE("seed " + std::to_string(seed));
  std::mt19937 random(seed);
  struct Case {
    const char* name;
    Vector3 approach;  // by the tool frame's axes
  };
  for (const Case& test :
       {Case{"/lynx5.toml", {1, 0, 0}}, {"/scara_cobra600.toml", {0, 0, 1}}, {"/puma560.toml", {0, 0, 1}}}) {
    const char* const name = test.name;
    const ArmModel model = load_profile(std::string(CORBOT_PROFILES) + name).arm;
    for (int i = 0; i < 100; ++i) {
      const Joints q = random_joints(model, random);
      const ArmBase base{{0.1, -0.2, 0.05}, std::uniform_real_distribution<double>(-3, 3)(random)};
      const ArmBody arm = body_at(model, base, q, model.gripper.closed_us);
      const Pose tool = model.kinematics.forward(q);
      const Eigen::AngleAxisd turn(base.yaw_rad, Vector3d::UnitZ());
      const Vector3d expected = base.position_m + turn * Vector3d(tool.position_m.data());
      EXPECT_LT((arm.hand.tool_m - expected).norm(), 1e-9) << name;
      EXPECT_LT((arm.links.back().to_m - expected).norm(), 1e-9) << name;
      const Vector3 approach = rotate(tool.orientation, test.approach);
      EXPECT_LT((arm.hand.direction - turn * Vector3d(approach.data())).norm(), 1e-9) << name;
      EXPECT_NEAR(arm.hand.across.z(), 0, 1e-12) << name;
      EXPECT_NEAR(arm.hand.across.norm(), 1, 1e-9) << name;
      for (std::size_t k = 1; k < arm.links.size(); ++k)
        EXPECT_EQ(arm.links[k].from_m, arm.links[k - 1].to_m);
    }
  }
}

TEST(ArmBody, LinksHaveTheLengthsOfTheProfile) {
  const ArmBody arm = body_at(lynx5(), {}, {0.3, 0.5, 0.7, 0.2}, 1500);
  const std::array<double, 4> lengths_m{0.067, 0.120, 0.120, 0.100};
  const std::array<double, 4> radii_m{0.035, 0.020, 0.018, 0.022};
  ASSERT_EQ(arm.links.size(), lengths_m.size());
  for (std::size_t i = 0; i < lengths_m.size(); ++i) {
    EXPECT_NEAR((arm.links[i].to_m - arm.links[i].from_m).norm(), lengths_m[i], 1e-9) << i;
    EXPECT_EQ(arm.links[i].radius_m, radii_m[i]) << i;
  }
}

TEST(ArmBody, TheGripperOpensByItsServo) {
  const GripperModel& gripper = lynx5().gripper;
  for (const auto& [share, opening_m] :
       {std::pair{0.0, 0.0}, {0.5, 0.016}, {1.0, 0.032}, {1.2, 0.032}, {-0.1, 0.0}}) {
    const double shaft_us = gripper.closed_us + share * (gripper.open_us - gripper.closed_us);
    EXPECT_NEAR(body_at(lynx5(), {}, {}, shaft_us).hand.opening_m, opening_m, 1e-9) << share;
  }
}

TEST(ArmBody, AHandThatIsHorizontalClosesAcrossItsDirection) {
  const ArmBody arm = body_at(lynx5(), {}, {0.4, 0.5, 0.7, 0.2}, 1500);
  EXPECT_NEAR(arm.hand.across.dot(arm.hand.direction), 0, 1e-9);
  EXPECT_NEAR(arm.hand.across.dot(Vector3d(std::cos(0.4), std::sin(0.4), 0)), 0, 1e-9) << "the arm's plane";
}

TEST(ArmBody, AScaraIsAColumnWithTwoLevelLinksAndAHandThatHangsFromThem) {
  const ArmModel model = cell_scara();
  std::mt19937 random(1751);
  for (int i = 0; i < 100; ++i) {
    Joints q = random_joints(model, random);
    if (i == 0) q[2] = 0;  // the slide's upper end
    const ArmBody arm = body_at(model, {}, q, 1500);
    ASSERT_EQ(arm.links.size(), 4u);
    const std::array<Vector3d, 4> links{
        Vector3d{0, 0, 0.16}, 0.175 * Vector3d(std::cos(q[0]), std::sin(q[0]), 0),
        0.175 * Vector3d(std::cos(q[0] + q[1] + to_radians(80)), std::sin(q[0] + q[1] + to_radians(80)), 0),
        Vector3d{0, 0, -0.06 + q[2]}};
    for (std::size_t k = 0; k < links.size(); ++k)
      EXPECT_LT((arm.links[k].to_m - arm.links[k].from_m - links[k]).norm(), 1e-9) << k;
  }
}

TEST(ArmBody, ASlideAtItsZeroChangesNoNumberOfLinks) {
  // Both tools are at their corner then: of a quill, and of an arm without a hand that turns.
  for (const char* name : {"/scara_cobra600.toml", "/cylindrical_rpp.toml", "/polar_rrp.toml"}) {
    const ArmModel model = load_profile(std::string(CORBOT_PROFILES) + name).arm;
    const ArmBody at_zero = body_at(model, {}, {}, model.gripper.closed_us);
    std::mt19937 random(1751);
    const ArmBody elsewhere = body_at(model, {}, random_joints(model, random), model.gripper.closed_us);
    EXPECT_EQ(at_zero.links.size(), elsewhere.links.size()) << name;
    EXPECT_NEAR(at_zero.hand.direction.norm(), 1, 1e-9) << name;
  }
}

/// A hanging tool, slightly askew by rounding, closes its fingers along the same axis of the tool everywhere.
TEST(ArmBody, AHandFromAboveClosesAlongOneAxisOfItsTool) {
  struct Case {
    const char* name;
    Quaternion tool;  // in the last frame, whose z points up
    Vector3 across;   // in the tool's frame
  };
  const double half = std::sqrt(0.5);
  for (const Case& test : {Case{"z downward", {0, 1, 0, 0}, {0, 1, 0}},
                           {"x downward, as the tool frame of the paper", {half, 0, half, 0}, {0, 0, 1}}}) {
    ArmModel model = cell_scara();
    model.kinematics.set_frames({}, {{0, 0, -0.06}, test.tool});
    std::mt19937 random(1751);
    for (int i = 0; i < 100; ++i) {
      const Joints q = random_joints(model, random);
      const ArmBody arm = body_at(model, {}, q, 1500);
      EXPECT_LT((arm.hand.direction + Vector3d::UnitZ()).norm(), 1e-9) << test.name;
      const Vector3 across = rotate(model.kinematics.forward(q).orientation, test.across);
      EXPECT_LT((arm.hand.across - Vector3d(across.data())).norm(), 1e-9) << test.name;
    }
  }
}

TEST(ArmClearance, AnOverlapIsOneTouchUntilTheArmsAreApart) {
  const auto at = [](double x_m) { return body_at(lynx5(), {{x_m, 0, 0}, 0}, {}, 1500); };
  ArmClearance clearance;
  const auto check = [&](double x_m) {
    const std::array<ArmBody, 2> arms{at(0), at(x_m)};
    clearance.check(arms);
  };
  check(1.0);
  EXPECT_EQ(clearance.touches(), 0);
  const double apart_m = clearance.nearest_m();
  EXPECT_GT(apart_m, 0);
  for (const double x_m : {0.05, 0.04, 0.05}) check(x_m);
  EXPECT_EQ(clearance.touches(), 1);
  EXPECT_LT(clearance.nearest_m(), 0);
  check(1.0);
  check(0.05);
  EXPECT_EQ(clearance.touches(), 2);
}

}  // namespace
}  // namespace corbot::sim
