// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <gtest/gtest.h>
#include <unistd.h>

#include <atomic>
#include <filesystem>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "config/load_profile.h"
#include "corbot/channel/fingerprint.h"
#include "corbot/channel/wake.h"
#include "robot/robot.h"
#include "rt/backends/loopback/loopback_backend.h"
#include "rt/cycle/cycle.h"
#include "rt/loop.h"
#include "shm/segment.h"
#include "support/process.h"

namespace corbot::test {

/// A real-time task whose every answer the test gives. While it runs, its cycle number rises.
class FakeTask {
 public:
  FakeTask(const std::string& name, const ArmModel& arm) : name_(name), arm_(arm) { adopt(); }
  FakeTask(const FakeTask&) = delete;
  FakeTask& operator=(const FakeTask&) = delete;
  ~FakeTask() { die(); }

  /// Gives the locks back, as death does.
  void die() {
    end_ = true;
    if (thread_.joinable()) thread_.join();
    segment_.reset();
  }
  /// Holds the lock, with an incarnation of its own; the cycle does not run yet.
  void adopt() { segment_.emplace(Segment::create_or_adopt(name_, fingerprint(arm_))); }
  void run() {
    snapshot_.incarnation = layout().header.incarnation.load();
    end_ = false;
    thread_ = std::thread([this] {
      while (!end_) {
        change([](Snapshot&) {});
        const timespec period{0, 1'000'000};
        ::nanosleep(&period, nullptr);
      }
    });
  }
  /// As a task that adopts a segment does.
  void drop_ring() {
    RingConsumer(layout().commands).clear();
    snapshot_.last_done_id = layout().header.next_command_id.load() - 1;
  }

  /// Changes the snapshot and publishes it.
  template <class Change>
  void change(Change&& how) {
    const std::lock_guard lock(mutex_);
    ++snapshot_.cycle;
    how(snapshot_);
    layout().snapshot.store(snapshot_);
    wake_one(layout().wake);
  }
  /// The command that is next in the ring has its verdict; the snapshot follows.
  void complete(Verdict verdict) {
    Command command{};
    ASSERT_EQ(RingConsumer(layout().commands).pop(command), PopResult::kOk);
    change([&](Snapshot& now) {
      ASSERT_TRUE(RingProducer(layout().completions).push({command.id, verdict, 0, now.cycle}));
      now.last_done_id = command.id;
    });
  }
  /// It has ended, and the record of how is lost.
  void lose_verdict() {
    Command command{};
    ASSERT_EQ(RingConsumer(layout().commands).pop(command), PopResult::kOk);
    change([&](Snapshot& now) { now.last_done_id = command.id; });
  }
  [[nodiscard]] SegmentLayout& layout() { return segment_->layout(); }

 private:
  const std::string name_;
  const ArmModel arm_;
  std::optional<Segment> segment_;
  std::mutex mutex_;
  Snapshot snapshot_{};
  std::atomic<bool> end_{false};
  std::thread thread_;
};

/// The real loop and cycle over simulated servos, in a thread of this process.
class LoopTask {
 public:
  LoopTask(const std::string& name, const ArmModel& arm)
      : segment_(Segment::create_or_adopt(name, fingerprint(arm))),
        backend_(arm, {}),
        cycle_(std::make_unique<rt::Cycle>(arm, segment_.layout(), backend_, stop_, rt::CycleStart{},
                                           rt::LivenessLimits{kNever_ns, kNever_ns})),
        loop_(*cycle_, segment_.layout(), {arm.period_ns, false, 0}) {
    backend_.open(cycle_->frame());
    thread_ = std::thread([this] { loop_.run(end_); });
  }
  LoopTask(const LoopTask&) = delete;
  LoopTask& operator=(const LoopTask&) = delete;
  /// Slows down on the path first; the segment stays, as after a death.
  ~LoopTask() {
    end_ = true;
    thread_.join();
  }
  [[nodiscard]] SegmentLayout& layout() { return segment_.layout(); }
  [[nodiscard]] rt::LoopbackBackend& backend() { return backend_; }

 private:
  /// A gap of a loaded machine is none of these tests' business.
  static constexpr std::int64_t kNever_ns = 3'600'000'000'000;

  Segment segment_;
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
  TaskTest() : profile_(load_profile(CORBOT_PROFILE)), name_(unique_name("task")) {}
  ~TaskTest() override { std::filesystem::remove("/dev/shm/corbot." + name_); }

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
  Outcome try_accept(const MotionRequest& request) {
    try {
      return {CORBOT_OK, "", robot_->accept(request)};
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

  const Profile profile_;
  const std::string name_;
  std::unique_ptr<Robot> robot_;
};

}  // namespace corbot::test
