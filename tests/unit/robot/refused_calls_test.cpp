// SPDX-License-Identifier: Apache-2.0
// Refused calls: an outcome that the interface has for their operation, and a text with value, limit and
// unit.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <string>

#include "corbot/arm/joint_units.h"
#include "robot/task_fixture.h"
#include "support/paths.h"

namespace corbot::test::refused_calls_test {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

class RefusedCalls : public TaskTest {
 protected:
  explicit RefusedCalls(const std::string& arm)
      : TaskTest((std::string(CORBOT_TEST_PROFILES "/") + arm + ".toml").c_str()),
        task_(name_, profile_.arm) {}

  void SetUp() override {
    open_robot();
    std::string path = CORBOT_SCRATCH_DIR "/refused-XXXXXX";
    directory_ = ::mkdtemp(path.data());
    robot_->keep_state(directory_, [](const std::string&) {});
  }
  void TearDown() override {
    robot_.reset();
    std::filesystem::remove_all(directory_);
  }
  /// In degrees or metres.
  CallError limit(std::size_t joint, double lower, double upper) {
    JointRanges wanted;
    for (std::size_t i = 0; i < profile_.arm.dof; ++i) {
      const JointKind kind = profile_.arm.kinematics.joint_kind(i);
      wanted.lower_q[i] = to_shown(kind, profile_.arm.joints[i].lower_q);
      wanted.upper_q[i] = to_shown(kind, profile_.arm.joints[i].upper_q);
    }
    wanted.lower_q[joint] = lower;
    wanted.upper_q[joint] = upper;
    return refusal([&] { robot_->set_soft_limits(wanted); });
  }
  template <class Call>
  static CallError refusal(Call&& call) {
    try {
      call();
    } catch (const CallError& refused) {
      return refused;
    }
    return {};
  }
  void expect_done(const MotionRequest& request) {
    const Outcome begun = try_accept(request);
    ASSERT_EQ(begun.status, CORBOT_OK) << begun.text;
    robot_->finish(begun.ticket);
  }

  LoopTask task_;
  std::string directory_;
};

class RefusedScara : public RefusedCalls {
 protected:
  RefusedScara() : RefusedCalls("scara_gx4") {}
};
class RefusedLynx : public RefusedCalls {
 protected:
  RefusedLynx() : RefusedCalls("lynx5") {}
};

TEST_F(RefusedScara, ReadyBeyondASoftLimitIsNotReadyAsItHasNoOtherException) {
  expect_done(DriveRequest{2, -0.05, 0.2});
  ASSERT_EQ(limit(2, -0.1, -0.02).error.status, CORBOT_OK);
  const Outcome refused = try_accept(ReadyRequest{});
  EXPECT_EQ(refused.status, CORBOT_NOT_READY);
  EXPECT_THAT(refused.text, AllOf(HasSubstr("joint 2"), HasSubstr("at 0 m"), HasSubstr("-0.1 to -0.02 m")));
  EXPECT_EQ(try_accept(DriveRequest{2, 0.05, 0.2}).status, CORBOT_LIMIT_EXCEEDED) << "which Drive has";
}

TEST_F(RefusedLynx, AReadyThatWouldTakeTooLongIsNotReady) {
  expect_done(DriveRequest{0, 0.5, 1.0});
  robot_->set_all_speeds(1e-3);
  const Outcome refused = try_accept(ReadyRequest{});
  EXPECT_EQ(refused.status, CORBOT_NOT_READY);
  EXPECT_THAT(refused.text, HasSubstr("allowed up to 3600 s"));
}

TEST_F(RefusedScara, SoftLimitsAreRefusedInTheUnitOfTheirJoint) {
  EXPECT_STREQ(limit(2, -0.01, -0.02).error.text,
               "joint 2: the lower limit -0.01 m is above the upper one, -0.02 m");
  EXPECT_STREQ(limit(0, 20.0, 10.0).error.text,
               "joint 0: the lower limit 20 degrees is above the upper one, 10 degrees");
  EXPECT_STREQ(limit(2, -0.2, 0.0).error.text,
               "joint 2: the limit -0.2 m is outside the range of the profile, -0.15 to 0 m");
  EXPECT_STREQ(limit(0, -141.0, 0.0).error.text,
               "joint 0: the limit -141 degrees is outside the range of the profile, -140 to 140 degrees");
  EXPECT_STREQ(limit(2, -0.1, -0.05).error.text,
               "joint 2 stands at 0 m, outside the wanted limits, -0.1 to -0.05 m");
}

TEST_F(RefusedScara, AToolPitchIsNotSentOnToAnOrientationThatIsRefusedAsWell) {
  const CallError pitch = refusal([&] { robot_->set_tool_pitch(10.0); });
  EXPECT_EQ(pitch.error.status, CORBOT_BAD_PARAMETER);
  EXPECT_STREQ(pitch.error.text,
               "this arm has no tool pitch: it follows the yaw of its tool alone, which its motions keep");
}

TEST_F(RefusedScara, AnOrientationThatItCannotTakeNamesTheKeyOfTheLimit) {
  const Pose tilted{{0.2, 0.1, -0.05}, about({1, 0, 0}, 3.0)};
  const Outcome refused = try_accept(MovePoseRequest{tilted});
  EXPECT_EQ(refused.status, CORBOT_UNREACHABLE);
  EXPECT_THAT(refused.text, HasSubstr("allowed up to 5.72958e-05 degrees (orientation_error_deg)"));
}

}  // namespace
}  // namespace corbot::test::refused_calls_test
