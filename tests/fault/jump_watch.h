// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <cstdint>
#include <memory>
#include <mutex>
#include <string>
#include <thread>

#include "corbot/arm/arm_model.h"
#include "shm/channel_client.h"

namespace corbot::test {

/// Follows the traces of a robot's tasks in a thread of its own and counts steps of the set-point that no
/// joint may make in a cycle.
class JumpWatch {
 public:
  JumpWatch(const std::string& robot, const ArmModel& arm);
  JumpWatch(const JumpWatch&) = delete;
  JumpWatch& operator=(const JumpWatch&) = delete;
  ~JumpWatch() { finish(); }

  void finish();
  [[nodiscard]] std::uint64_t cycles() const { return cycles_; }
  [[nodiscard]] std::uint64_t moving_cycles() const { return moving_; }
  [[nodiscard]] int jumps() const { return jumps_; }
  [[nodiscard]] std::string first_jump() const { return first_jump_; }
  [[nodiscard]] Snapshot newest() const;

 private:
  [[nodiscard]] std::shared_ptr<Observer> channel() const;
  void follow();
  void follow_task(const Observer& channel);
  void compare(const Snapshot& last, const Snapshot& now);

  const std::string robot_;
  mutable std::mutex mutex_;  // of channel_
  std::shared_ptr<Observer> channel_;
  std::uint64_t task_{0};
  std::uint64_t next_{0};
  Snapshot last_{};
  bool have_last_{false};
  ArmModel arm_;
  std::atomic<bool> end_{false};
  std::atomic<std::uint64_t> cycles_{0};
  std::atomic<std::uint64_t> moving_{0};
  std::atomic<int> jumps_{0};
  std::string first_jump_;
  std::thread thread_;
};

}  // namespace corbot::test
