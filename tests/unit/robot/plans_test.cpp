// SPDX-License-Identifier: Apache-2.0
// Plans that start nothing: what they say is what the motion becomes, and when they are refused.
#include <gmock/gmock.h>

#include <functional>

#include "robot/called_robot.h"

namespace corbot::test::plans_test {
namespace {

using ::testing::HasSubstr;

class Plans : public CalledRobot {
 protected:
  using Start = std::function<corbot_status(const corbot_caller&)>;
  Start line(double x, double y, double z, double t_s = 0.0) {
    return [=, this](const corbot_caller& from) {
      const double p_m[] = {x, y, z};
      return corbot_robot_move_s(called_.get(), &from, p_m, 0.0, t_s, &ticket_, &error_);
    };
  }
  Start joint(int number, double increment_deg, double speed_deg_s) {
    return [=, this](const corbot_caller& from) {
      return corbot_robot_drive(called_.get(), &from, number, increment_deg, speed_deg_s, &ticket_, &error_);
    };
  }
  Start arc() {
    return [this](const corbot_caller& from) {
      const double p1_m[] = {0.2, -0.03, 0.1}, p2_m[] = {0.22, 0.0, 0.12}, p3_m[] = {0.2, 0.03, 0.1};
      return corbot_robot_move_c(called_.get(), &from, p1_m, p2_m, p3_m, &ticket_, &error_);
    };
  }
  corbot_status plan(const Start& start, const std::string& key = "") {
    corbot_caller from = caller(key);
    from.plan = &plan_;
    return start(from);
  }
  corbot_arm_state state() {
    corbot_arm_state now{};
    EXPECT_EQ(corbot_robot_arm_state(called_.get(), &now, &error_), CORBOT_OK) << error_.text;
    return now;
  }

  corbot_plan plan_{};
};

TEST_F(Plans, AreWhatTheMotionBecomes) {
  open_at_rest();
  for (const Start& start : {line(0.22, 0.02, 0.1), joint(1, 20.0, 90.0), arc(), line(0.2, 0.0, 0.1, 2.0)}) {
    const corbot_arm_state before = state();
    ticket_ = 0;
    ASSERT_EQ(plan(start), CORBOT_OK) << error_.text;
    EXPECT_EQ(ticket_, 0u) << "nothing is accepted";
    double all_s = 0.0;
    for (std::size_t k = 0; k < plan_.part_count; ++k) all_s += plan_.parts[k].duration_s;
    ASSERT_EQ(start(caller(public_)), CORBOT_OK) << error_.text;
    const corbot_motion_info end = end_of(ticket_);
    EXPECT_EQ(end.state, CORBOT_MOTION_DONE);
    EXPECT_NEAR(all_s, end.duration_s, 1e-12);
    const corbot_arm_state after = state();
    for (int i = 0; i < 4; ++i) {
      EXPECT_NEAR(plan_.start[i], before.commanded[i], 1e-9);
      EXPECT_NEAR(plan_.end[i], after.commanded[i], 1e-6);
    }
  }
}

TEST_F(Plans, SayWhatSetsTheTime) {
  open_at_rest();
  ASSERT_EQ(plan(joint(1, 60.0, 150.0)), CORBOT_OK) << error_.text;
  ASSERT_EQ(plan_.part_count, 1u);
  const corbot_plan_part& turn = plan_.parts[0];
  ASSERT_EQ(turn.stretch_count, 1u);
  EXPECT_EQ(turn.stretches[0].owner, CORBOT_OWNER_JOINT);
  EXPECT_EQ(turn.stretches[0].joint, 1);
  EXPECT_EQ(turn.stretches[0].limit, CORBOT_LIMIT_SPEED);
  EXPECT_EQ(turn.has_pivot, 0);

  ASSERT_EQ(plan(arc()), CORBOT_OK) << error_.text;
  ASSERT_EQ(plan_.part_count, 2u) << "the way to P1, and the arc";
  const corbot_plan_part& part = plan_.parts[1];
  ASSERT_GE(part.stretch_count, 2u);
  double end_s = 0.0;
  for (std::size_t i = 0; i < part.stretch_count; ++i) {
    EXPECT_EQ(part.stretches[i].begin_s, end_s) << "without a gap";
    end_s = part.stretches[i].end_s;
    EXPECT_GT(part.stretches[i].share, 0.5);
    EXPECT_LT(part.stretches[i].share, 1.0001);
  }
  EXPECT_NEAR(end_s, part.duration_s, 1e-9);
  EXPECT_EQ(part.has_pivot, 1);
  EXPECT_GT(part.least_pivot, 0.0);
}

TEST_F(Plans, BeginWhereTheQueueEndsAndAreInTheFramesInForce) {
  open_at_rest();
  corbot_robot_keep_state(called_.get(), directory_.c_str(), nullptr);
  const corbot_tool_pose elsewhere{{2.0, -1.0, 0.5}, {1.0, 0.0, 0.0, 0.0}};
  const corbot_caller anyone = caller(public_);
  ASSERT_EQ(corbot_robot_set_base_frame(called_.get(), &anyone, &elsewhere, &error_), CORBOT_OK)
      << error_.text;
  ASSERT_EQ(drive(public_, 30.0, 10.0), CORBOT_OK) << error_.text;
  const corbot_ticket under_way = ticket_;
  ASSERT_EQ(plan(line(2.2, -1.0, 0.6)), CORBOT_OK) << error_.text;
  EXPECT_NEAR(plan_.start[0], 30.0, 1e-9) << "while the arm is on its way there";
  EXPECT_NEAR(plan_.parts[0].pivot_point_m[0], 2.25, 0.2);
  EXPECT_NEAR(plan_.parts[0].pivot_point_m[1], -0.9, 0.15);
  corbot_motion_info now{};
  ASSERT_EQ(corbot_robot_wait(called_.get(), under_way, 0.0, nullptr, &now, &error_), CORBOT_OK);
  EXPECT_NE(now.state, CORBOT_MOTION_STOPPED);
}

TEST_F(Plans, NeedNoControlAndAreRefusedAsTheMotionIs) {
  open_at_rest();
  const std::string key = acquire("cell 7", kLong_s);
  EXPECT_EQ(drive(public_, 1.0), CORBOT_NOT_READY);
  EXPECT_EQ(plan(joint(0, 1.0, 20.0)), CORBOT_OK) << error_.text;
  EXPECT_EQ(plan(joint(0, 1.0, 1000.0)), CORBOT_LIMIT_EXCEEDED);
  EXPECT_EQ(plan(line(5.0, 0.0, 0.1)), CORBOT_UNREACHABLE);
  EXPECT_EQ(plan(line(0.2, 0.0, 0.1, -1.0)), CORBOT_BAD_PARAMETER);
  ASSERT_EQ(corbot_robot_stop_and_hold(called_.get(), nullptr, &error_), CORBOT_OK) << error_.text;
  EXPECT_EQ(plan(joint(0, 1.0, 20.0)), CORBOT_NOT_READY);
  EXPECT_THAT(std::string(error_.text), HasSubstr("is held"));
  EXPECT_EQ(plan(line(0.2, 0.0, 0.1, -1.0)), CORBOT_BAD_PARAMETER) << "before all else";
}

}  // namespace
}  // namespace corbot::test::plans_test
