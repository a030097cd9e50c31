// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <condition_variable>
#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <string>
#include <thread>

#include "panel/robot_port.h"

namespace corbot::panel {

/// Watches one robot. One thread polls its state at 50 Hz and connects again after a failure, another one stops it: a poll that
/// hangs holds up no Stop. Thread-safe.
class RobotWatch {
 public:
  /// The newest state as JSON, or why there is none. The number rises with each text; 0: there was none yet.
  struct State {
    std::uint64_t number{0};
    std::shared_ptr<const std::string> text{};
  };
  /// How the newest Stop ended, and with it all of lower numbers. Empty failure: the arm is at rest.
  struct StopResult {
    std::uint64_t number{0};
    std::string failure{};
  };

  RobotWatch(std::string name, std::unique_ptr<RobotPort> port);
  RobotWatch(const RobotWatch&) = delete;
  RobotWatch& operator=(const RobotWatch&) = delete;
  /// Waits for calls of the port that are under way.
  ~RobotWatch();

  /// Starts both threads. They call `changed`, which must not block, after each new state and each Stop. Once.
  void start(std::function<void()> changed);
  /// Asks both threads to end. A Stop that was requested before is still carried out.
  void end();

  [[nodiscard]] const std::string& name() const noexcept { return name_; }
  [[nodiscard]] State newest() const;
  /// What connect() of the port returned last; an empty object before.
  [[nodiscard]] nlohmann::json description() const;

  /// Stops the robot and does not wait. Returns the number of this Stop, for last_stop().
  std::uint64_t request_stop();
  [[nodiscard]] StopResult last_stop() const;

 private:
  using Clock = std::chrono::steady_clock;

  void run_polls();
  void poll_until_failure();
  void run_stops();
  void publish(nlohmann::json state);
  /// False when the watch is to end.
  [[nodiscard]] bool sleep_until(Clock::time_point time);

  std::string name_;
  std::unique_ptr<RobotPort> port_;
  std::function<void()> changed_;

  mutable std::mutex mutex_;
  std::condition_variable wake_;
  bool ending_{false};
  State newest_;
  nlohmann::json description_ = nlohmann::json::object();
  std::uint64_t connections_{0};
  std::uint64_t stops_requested_{0};
  StopResult last_stop_;

  std::thread polls_;
  std::thread stops_;
};

}  // namespace corbot::panel
