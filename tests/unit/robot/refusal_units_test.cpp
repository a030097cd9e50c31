// SPDX-License-Identifier: Apache-2.0
// The numbers of every refusal of the planner reach the interface in the unit of its text, whatever its
// parameter is called.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>
#include <string>
#include <vector>

#include "corbot/arm/joint_units.h"
#include "corbot/kinematics/tool_pose.h"
#include "planner/arc.h"
#include "planner/frame_settings.h"
#include "planner/plan/refusal.h"
#include "planner/planner.h"
#include "planner/pose_solutions.h"
#include "robot/call_error.h"
#include "support/test_arms.h"

namespace corbot::refusal_units_test {
namespace {

using test::arm_of;
using ::testing::HasSubstr;

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kDegrees = 180.0 / std::numbers::pi;
constexpr Quaternion kTwice{2.0, 0.0, 0.0, 0.0};
constexpr std::array<double, 3> kGood_m{0.22, 0.02, 0.12};

/// This is a refusal with what its reply must be.
struct Row {
  PlanRefusal refusal;
  Quantity quantity;
  double factor;     ///< from the planner's unit to the interface's
  const char* text;  ///< has the reply's value and its unit; without braces where the text gives no value
};

/// Each joint stands in the middle of its range.
PlanStart middle(const ArmModel& arm) {
  PlanStart start;
  for (std::size_t i = 0; i < arm.dof; ++i)
    start.position_q[i] = 0.5 * (arm.joints[i].lower_q + arm.joints[i].upper_q);
  return start;
}

PlanRefusal refusal_of(const ArmModel& arm, const MotionRequest& request, const PlanSettings& settings = {}) {
  return std::get<PlanRefusal>(Planner(arm).plan(middle(arm), settings, request));
}

void expect_reply(const Row& row, const ArmModel& arm, const std::string& parameter) {
  SCOPED_TRACE(row.refusal.parameter + " as " + parameter + ": " + row.refusal.text);
  PlanRefusal refusal = row.refusal;
  refusal.parameter = parameter;
  const corbot_error reply = refused(refusal, arm.kinematics).error;
  EXPECT_EQ(refusal.quantity, row.quantity);
  EXPECT_STREQ(reply.parameter, parameter.c_str());
  EXPECT_THAT(std::string(reply.text), HasSubstr(fmt::format(fmt::runtime(row.text), reply.value)));
  const auto expect_shown = [&](double shown, double value) {
    if (std::isfinite(value))
      EXPECT_NEAR(shown, value * row.factor, 1e-8);
    else
      EXPECT_FALSE(std::isfinite(shown));
  };
  expect_shown(reply.value, refusal.value);
  expect_shown(reply.lower, refusal.lower);
  expect_shown(reply.upper, refusal.upper);
}

/// Each refusal goes out as it is, and with an unknown parameter: the parameter's name decides nothing.
void expect_replies(const std::vector<Row>& rows, const ArmModel& arm) {
  for (const Row& row : rows) {
    expect_reply(row, arm, row.refusal.parameter);
    expect_reply(row, arm, "renamed");
  }
}

/// Joint 1 of the arm is asked to leave its range, to be too fast, and for what is no number.
std::vector<Row> rows_of_a_joint(const ArmModel& arm, double factor, const char* at, const char* speed) {
  Joints beyond{}, no_number{};
  beyond[1] = arm.joints[1].upper_q + 1.0;
  no_number[1] = kNan;
  const Quantity value = Quantity::kJointValue, rate = Quantity::kJointSpeed;
  return {
      {refusal_of(arm, MoveJointsRequest{beyond, 0.0}), value, factor, at},
      {refusal_of(arm, MoveJointsRequest{no_number, 0.0}), value, factor, "joint 1 is not a finite number"},
      {refusal_of(arm, DriveRequest{1, kNan, 0.1}), value, factor, "increment is not a finite number"},
      {refusal_of(arm, DriveRequest{1, 10.0, 0.01}), value, factor, at},
      {refusal_of(arm, DriveRequest{1, 0.0, -1.0}), rate, factor, speed},
      {refusal_of(arm, DriveRequest{1, 0.0, 50.0}), rate, factor, speed},
  };
}

/// The unit of these does not depend on the arm.
std::vector<Row> rows_of_arguments(const ArmModel& arm) {
  PlanSettings slow, no_pitch, no_orientation;
  slow.speed_ratio = 1e-6;
  no_pitch.tool_pitch_rad = kNan;
  no_orientation.tool_orientation = kTwice;
  const Pose stretched{kGood_m, kTwice};
  const MoveRelativeRequest no_frame{{}, static_cast<OffsetFrame>(3), 0.0, false};
  const Quantity number = Quantity::kNumber;
  return {
      {refusal_of(arm, MoveRequest{{1e9, 0.0, 0.0}, 0.0}), Quantity::kLength, 1.0, "x of P is {:.6g} m"},
      {refusal_of(arm, MoveRequest{kGood_m, 0.0}, no_pitch), Quantity::kAngle, kDegrees,
       "not a finite number"},
      {refusal_of(arm, MoveRequest{kGood_m, 0.0}, no_orientation), number, 1.0, "has length {:.6g},"},
      {refusal_of(arm, MovePoseRequest{stretched, 0.0, false}), number, 1.0, "has length {:.6g},"},
      {refusal_of(arm, MovePoseRequest{{kGood_m, {kNan, 0, 0, 0}}, 0.0, false}), number, 1.0, "is nan,"},
      {refusal_of(arm, DwellRequest{-1.0}), Quantity::kTime, 1.0, "t = {:.6g} s,"},
      {refusal_of(arm, MoveJointsRequest{{}, 0.0}, slow), Quantity::kTime, 1.0, "takes {:.6g} s,"},
      {refusal_of(arm, DriveRequest{7, 0.1, 0.1}), number, 1.0, "joint {:.6g},"},
      {refusal_of(arm, GripperRequest{2.0}), number, 1.0, "opening {:.6g},"},
      {refusal_of(arm, no_frame), number, 1.0, "frame {:.6g},"},
      {refusal_of(arm, MoveCRequest{kGood_m, kGood_m, {0.2, 0.0, 0.1}}), Quantity::kLength, 1.0,
       "are {:.6g} m apart"},
      {refusal_of(arm, MoveCRequest{{0.2, 0.0, 0.1}, {0.2, 0.0, 0.2}, {0.2, 0.0, 0.3}}), number, 1.0,
       "(flatness {:.3g},"},
      {std::get<PlanRefusal>(solutions_at(arm, {}, stretched, {})), number, 1.0, "has length {:.9g},"},
      {check_base_frame({{1e9, 0.0, 0.0}, {}}).value(), Quantity::kLength, 1.0, "coordinate {:.6g} m,"},
      {check_base_frame({{}, kTwice}).value(), number, 1.0, "has length {:.9g},"},
      {check_tool_frame(arm.kinematics, {{1e9, 0.0, 0.0}, {}}).value(), Quantity::kLength, 1.0,
       "coordinate {:.6g} m,"},
      {not_found(kGood_m, {}), Quantity::kLength, 1.0, "stays {:.3g} m and"},
  };
}

TEST(RefusalUnits, OfAJointThatTurnsAreDegrees) {
  const ArmModel arm = arm_of("lynx5");
  expect_replies(rows_of_a_joint(arm, kDegrees, "at {:.6g} degrees", "speed {:.6g} degrees/s"), arm);
}

TEST(RefusalUnits, OfAJointThatSlidesAreMetres) {
  const ArmModel arm = arm_of("cartesian_ppp");
  expect_replies(rows_of_a_joint(arm, 1.0, "at {:.6g} m", "speed {:.6g} m/s"), arm);
}

TEST(RefusalUnits, OfArgumentsAreThoseOfTheText) {
  for (const char* name : {"lynx5", "puma560"}) {
    const ArmModel arm = arm_of(name);
    expect_replies(rows_of_arguments(arm), arm);
  }
}

TEST(RefusalUnits, OfWhatCannotBeReached) {
  ArmModel arm = arm_of("lynx5");
  arm.orientation_error_rad = 0.0;
  const Pose here = arm.kinematics.forward(middle(arm).position_q);
  const double half_rad = to_radians(2.5);
  // Five degrees about the tool's own axis, which this arm cannot turn.
  const Pose turned{here.position_m,
                    here.orientation * Quaternion{std::cos(half_rad), std::sin(half_rad), 0, 0}};
  const Pose square{{}, {0.5, -0.5, 0.5, 0.5}};
  const ArmModel turntable = arm_of("turntable");
  expect_replies(
      {
          {refusal_of(arm, MoveRequest{{0.9, 0.1, 0.1}, 0.0}), Quantity::kLength, 1.0,
           "would be {:.6g} m from the shoulder"},
          {refusal_of(arm, MovePoseRequest{turned, 0.0, false}), Quantity::kAngle, kDegrees,
           "than {:.6g} degrees,"},
          {check_tool_frame(arm.kinematics, square).value(), Quantity::kNumber, 1.0, "pitch: {:.3g} of it"},
          {refusal_of(turntable, MoveSRequest{kGood_m, 0.0}), Quantity::kNumber, 1.0, "no lines and arcs"},
      },
      arm);
}

TEST(RefusalUnits, OfTheWorkspaceHaveTheirWholeTextInTheQuantity) {
  ArmModel arm = arm_of("lynx5");
  WorkspaceShape& floor = arm.workspace.shapes[arm.workspace.count++];
  floor = plane_shape({{0.0, 0.0, 1.0}, 0.5}, 1);
  std::string(WorkspaceShape::kLongestName, 'f').copy(floor.name.data(), WorkspaceShape::kLongestName);
  const PlanRefusal refusal = refusal_of(arm, DriveRequest{1, -0.5, 0.5});
  const corbot_error reply = refused(refusal, arm.kinematics).error;
  EXPECT_EQ(reply.status, CORBOT_LIMIT_EXCEEDED);
  EXPECT_STREQ(reply.parameter, ("workspace: " + refusal.text).c_str());
  EXPECT_THAT(refusal.text, HasSubstr("may only move back"));
  EXPECT_LT(reply.value, reply.lower);
}

}  // namespace
}  // namespace corbot::refusal_units_test
