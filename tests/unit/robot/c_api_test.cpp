// SPDX-License-Identifier: Apache-2.0
// corbot_robot.h without a real-time task: what can be known is known, everything else is refused in words.
#include <gtest/gtest.h>
#include <unistd.h>

#include <cstring>
#include <memory>
#include <string>

#include "config/arms/write_urdf.h"
#include "config/load_profile.h"
#include "robot/call_error.h"
#include "robot/corbot_robot.h"
#include "support/paths.h"

namespace corbot::c_api_test {
namespace {

struct Closer {
  void operator()(corbot_robot* robot) const { corbot_robot_close(robot); }
};

class CApi : public ::testing::Test {
 protected:
  void SetUp() override {
    const std::string name = "capi-" + std::to_string(::getpid()) + "-" +
                             ::testing::UnitTest::GetInstance()->current_test_info()->name();
    robot_.reset(corbot_robot_open(CORBOT_SHIPPED_PROFILE, name.substr(0, 40).c_str(), &error_));
    ASSERT_NE(robot_, nullptr) << error_.text;
  }
  std::unique_ptr<corbot_robot, Closer> robot_;
  corbot_error error_{};
};

TEST_F(CApi, DescribesTheArm) {
  corbot_description description{};
  corbot_robot_describe(robot_.get(), &description);
  EXPECT_EQ(description.dof, 4);
  EXPECT_EQ(description.lower[0], -90.0);
  EXPECT_NEAR(description.reach_m, 0.34, 1e-12);
}

TEST_F(CApi, GivesTheArmAsAUrdf) {
  const Profile profile = load_profile(CORBOT_SHIPPED_PROFILE);
  EXPECT_EQ(corbot_robot_urdf(robot_.get()),
            config::write_urdf(profile.arm, profile.name, profile.joint_names));
}

TEST_F(CApi, WithoutATaskReadsHaveNoDataAndMotionsAreNotReady) {
  double joints[CORBOT_MAX_JOINTS];
  EXPECT_EQ(corbot_robot_joints(robot_.get(), joints, &error_), CORBOT_NO_DATA);
  EXPECT_NE(std::string(error_.text).find("corbot"), std::string::npos) << error_.text;
  EXPECT_EQ(corbot_robot_state(robot_.get()), CORBOT_STATE_ERROR);
  corbot_ticket ticket = 0;
  EXPECT_EQ(corbot_robot_ready(robot_.get(), nullptr, &ticket, &error_), CORBOT_NOT_READY);
  EXPECT_NE(std::string(error_.text).find("not running"), std::string::npos) << error_.text;
  EXPECT_EQ(corbot_robot_stop(robot_.get(), nullptr, &error_), CORBOT_NOT_READY);
  EXPECT_EQ(corbot_robot_stop(robot_.get(), nullptr, nullptr), CORBOT_NOT_READY)
      << "the error may be left out";
}

TEST(ReadKey, TakesWhatCanBeAKeyAndNothingElse) {
  const std::string good = "0123456789abcdef0123456789abcdef";
  const auto read = [](const std::string& octets) {
    char key[CORBOT_KEY];
    corbot_read_key(octets.data(), octets.size(), key);
    return std::string(key);
  };
  EXPECT_EQ(read(good), good);
  EXPECT_EQ(read(""), "-");
  EXPECT_EQ(read(good.substr(1)), "-");
  EXPECT_EQ(read(good + "0"), "-");
  EXPECT_EQ(read(std::string(32, '\0')), "-");
  EXPECT_EQ(read(good.substr(0, 31) + '\0'), "-");
}

TEST_F(CApi, ArgumentsAreCheckedFirst) {
  const double nowhere_m[3] = {0.2, 0.0, 1e9};
  const double folded_deg[4] = {0.0, 0.0, 500.0, 0.0};
  corbot_ticket ticket = 0;
  EXPECT_EQ(corbot_robot_move(robot_.get(), nullptr, nowhere_m, 0.0, 0.0, &ticket, &error_),
            CORBOT_BAD_PARAMETER);
  EXPECT_STREQ(error_.parameter, "Pz");
  EXPECT_EQ(corbot_robot_delay(robot_.get(), nullptr, -1.0, &ticket, &error_), CORBOT_BAD_PARAMETER);
  EXPECT_STREQ(error_.parameter, "t");
  EXPECT_EQ(corbot_robot_drive(robot_.get(), nullptr, 7, 1.0, 1.0, &ticket, &error_), CORBOT_BAD_PARAMETER);
  EXPECT_STREQ(error_.parameter, "articulation");
  EXPECT_EQ(corbot_robot_move_joints(robot_.get(), nullptr, folded_deg, 4, 0.0, &ticket, &error_),
            CORBOT_LIMIT_EXCEEDED);
  EXPECT_EQ(error_.joint, 2);
}

TEST_F(CApi, SettingsNeedNoTask) {
  EXPECT_EQ(corbot_robot_speed(robot_.get(), nullptr, 50.0, &error_), CORBOT_OK);
  EXPECT_EQ(corbot_robot_art_speed(robot_.get(), nullptr, 1, 20.0, &error_), CORBOT_OK);
  double tool = 0.0, joints[CORBOT_MAX_JOINTS];
  corbot_robot_speeds(robot_.get(), &tool, &joints[0]);
  EXPECT_DOUBLE_EQ(tool, 50.0);
  EXPECT_DOUBLE_EQ(joints[0], 100.0);
  EXPECT_DOUBLE_EQ(joints[1], 20.0);
  EXPECT_EQ(corbot_robot_speed(robot_.get(), nullptr, 0.0, &error_), CORBOT_BAD_PARAMETER);
  EXPECT_STREQ(error_.parameter, "percent");
  EXPECT_EQ(corbot_robot_art_speed(robot_.get(), nullptr, 4, 50.0, &error_), CORBOT_BAD_PARAMETER);
  EXPECT_STREQ(error_.parameter, "articulation");
  EXPECT_EQ(corbot_robot_set_tool_pitch(robot_.get(), nullptr, 12.5, &error_), CORBOT_OK);
  EXPECT_NEAR(corbot_robot_tool_pitch(robot_.get()), 12.5, 1e-12);
}

TEST(CApiOpen, ABadProfileIsNamed) {
  corbot_error error{};
  EXPECT_EQ(corbot_robot_open("/nonexistent/arm.toml", nullptr, &error), nullptr);
  EXPECT_NE(std::string(error.text).find("/nonexistent/arm.toml"), std::string::npos) << error.text;
}

TEST(CopyText, IsAsciiAndTerminatedWhateverComes) {
  char text[8];
  copy_text("\xc3\xa4 long text that does not fit", text, sizeof(text));
  EXPECT_STREQ(text, "?? long");
}

}  // namespace
}  // namespace corbot::c_api_test
