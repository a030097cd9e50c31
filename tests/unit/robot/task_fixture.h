// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <gtest/gtest.h>
#include <unistd.h>

#include <atomic>
#include <memory>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "config/load_profile.h"
#include "corbot/channel/fingerprint.h"
#include "corbot/channel/wake.h"
#include "robot/fake_task.h"
#include "robot/robot.h"
#include "rt/backends/loopback/loopback_backend.h"
#include "rt/cycle/cycle.h"
#include "rt/loop.h"
#include "shm/channel_client.h"
#include "shm/channel_server.h"
#include "support/paths.h"
#include "support/process.h"

namespace corbot::test {

/// The real loop and cycle over simulated servos, in a thread of this process.
class LoopTask {
 public:
  LoopTask(const std::string& name, const ArmModel& arm)
      : channel_(name, arm),
        backend_(arm, {}),
        cycle_(std::make_unique<rt::Cycle>(
            arm, rt::CycleChannel{*channel_.task, channel_.stop->count, channel_.servants}, backend_, stop_,
            rt::CycleStart{.position_known = true}, rt::CycleSettings{.liveness = {kNever_ns, kNever_ns}})),
        loop_(*cycle_, *channel_.task, {arm.period_ns, false, 0}) {
    backend_.open(cycle_->frame());
    thread_ = std::thread([this] { loop_.run(end_); });
  }
  LoopTask(const LoopTask&) = delete;
  LoopTask& operator=(const LoopTask&) = delete;
  /// Slows down on the path first.
  ~LoopTask() {
    end_ = true;
    thread_.join();
  }
  [[nodiscard]] TaskSegment& task() { return *channel_.task; }
  [[nodiscard]] rt::LoopbackBackend& backend() { return backend_; }

 private:
  /// A gap of a loaded machine is none of these tests' business.
  static constexpr std::int64_t kNever_ns = 3'600'000'000'000;

  TaskEnd channel_;
  EmergencyStop stop_;
  rt::LoopbackBackend backend_;
  std::unique_ptr<rt::Cycle> cycle_;
  rt::Loop loop_;
  std::atomic<bool> end_{false};
  std::thread thread_;
};

/// A robot name of the test's own, nothing of which is left behind.
class TaskTest : public ::testing::Test {
 protected:
  explicit TaskTest(const char* profile = CORBOT_TEST_PROFILE)
      : profile_(patient_profile(profile)), name_(unique_name("task")) {}
  ~TaskTest() override { remove_left_behind(name_); }

  void open_robot() {
    robot_ = std::make_unique<Robot>(profile_, name_);
    ASSERT_TRUE(wait_until(within(30), [&] { return robot_->view().state() != CORBOT_STATE_ERROR; }));
  }
  /// The status that a call ends with, and its text.
  struct Outcome {
    corbot_status status;
    std::string text;
    corbot_ticket ticket;
  };
  Outcome try_accept(const MotionRequest& request, std::uint64_t arrival = 0) {
    try {
      return {CORBOT_OK, "", robot_->accept(request, arrival)};
    } catch (const CallError& refused) {
      return {refused.error.status, refused.error.text, 0};
    }
  }
  template <class Call>
  static corbot_status status_of(Call&& call) {
    try {
      call();
      return CORBOT_OK;
    } catch (const CallError& refused) {
      return refused.error.status;
    }
  }

  /// A task that a busy machine lets stand still for a while is not frozen.
  static Profile patient_profile(const char* file) {
    Profile profile = load_profile(file);
    profile.frozen_ns = 30'000'000'000;
    return profile;
  }

  const Profile profile_;
  const std::string name_;
  std::unique_ptr<Robot> robot_;
};

}  // namespace corbot::test
