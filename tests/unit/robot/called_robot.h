// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <stdlib.h>

#include <filesystem>
#include <fstream>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "robot/corbot_robot.h"
#include "robot/task_fixture.h"
#include "support/paths.h"

namespace corbot::test {

/// The robot as the adapters see it, over the real cycle in a thread of this process.
class CalledRobot : public TaskTest {
 protected:
  static constexpr double kLong_s = 600.0;

  explicit CalledRobot(const char* profile = CORBOT_TEST_PROFILE) : TaskTest(profile) {
    std::string path = CORBOT_SCRATCH_DIR "/called-XXXXXX";
    directory_ = ::mkdtemp(path.data());
    task_ = std::make_unique<LoopTask>(name_, profile_.arm);
  }
  ~CalledRobot() override {
    called_.reset();
    task_.reset();
    std::filesystem::remove_all(directory_);
  }

  struct Closer {
    void operator()(corbot_robot* robot) const { corbot_robot_close(robot); }
  };
  void open() {
    corbot_error error{};
    called_.reset(corbot_robot_open(profile_.file.c_str(), name_.c_str(), &error));
    ASSERT_NE(called_, nullptr) << error.text;
  }
  void open_at_rest() {
    open();
    ASSERT_TRUE(until_state(CORBOT_STATE_STANDBY));
  }
  bool until_state(corbot_state state) {
    return wait_until(within(30), [&] { return corbot_robot_state(called_.get()) == state; });
  }
  /// As a servant that is killed: its successor gets nothing but the segment.
  void restart_servant() {
    called_.reset();
    open();
    ASSERT_TRUE(wait_until(within(30), [&] { return robot_ended_connecting(); }));
  }
  bool robot_ended_connecting() {
    corbot_error error{};
    double joints_deg[CORBOT_MAX_JOINTS];
    return corbot_robot_joints(called_.get(), joints_deg, &error) == CORBOT_OK;
  }
  [[nodiscard]] double joint_0_deg() {
    corbot_error error{};
    double joints_deg[CORBOT_MAX_JOINTS]{};
    EXPECT_EQ(corbot_robot_joints(called_.get(), joints_deg, &error), CORBOT_OK) << error.text;
    return joints_deg[0];
  }

  static corbot_caller caller(const std::string& key) {
    corbot_caller caller{};
    caller.key = key.c_str();
    caller.from = "127.0.0.1:40000";
    return caller;
  }
  std::string acquire(const std::string& who, double lease_s) {
    char key[CORBOT_KEY];
    const corbot_caller anyone = caller(public_);
    EXPECT_EQ(corbot_robot_acquire(called_.get(), &anyone, who.c_str(), lease_s, key, &error_), CORBOT_OK)
        << error_.text;
    return key;
  }
  corbot_status drive(const std::string& key, double increment_deg, double speed_deg_s = 20.0) {
    const corbot_caller from = caller(key);
    return corbot_robot_drive(called_.get(), &from, 0, increment_deg, speed_deg_s, &ticket_, &error_);
  }
  /// A busy machine may suspend the task for a moment, which ends a wait early. So it waits again.
  corbot_motion_info end_of(corbot_ticket ticket) {
    corbot_motion_info info{};
    corbot_error error{};
    EXPECT_TRUE(wait_until(within(30), [&] {
      EXPECT_EQ(corbot_robot_wait(called_.get(), ticket, 30.0, nullptr, &info, &error), CORBOT_OK)
          << error.text;
      return info.state != CORBOT_MOTION_QUEUED && info.state != CORBOT_MOTION_RUNNING;
    }));
    return info;
  }
  bool is_alarm_active(int32_t code, const std::string& part) {
    corbot_alarm alarms[CORBOT_MAX_ALARMS];
    const std::size_t count = corbot_robot_alarms(called_.get(), alarms);
    for (std::size_t i = 0; i < count; ++i) {
      if (alarms[i].code == code && alarms[i].active &&
          std::string(alarms[i].text).find(part) != std::string::npos)
        return true;
    }
    return false;
  }
  std::size_t alarms_of(int32_t code) {
    corbot_alarm alarms[CORBOT_MAX_ALARMS];
    const std::size_t count = corbot_robot_alarms(called_.get(), alarms);
    return static_cast<std::size_t>(std::count_if(
        alarms, alarms + count, [code](const corbot_alarm& alarm) { return alarm.code == code; }));
  }

  const std::string public_;
  std::string directory_;
  std::unique_ptr<LoopTask> task_;
  std::unique_ptr<corbot_robot, Closer> called_;
  corbot_ticket ticket_{};
  corbot_error error_{};
};

}  // namespace corbot::test
