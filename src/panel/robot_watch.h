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

/// Watches one robot. One thread polls the state at 50 Hz, and connects again after a failure. Another thread
/// stops the robot, so a poll that hangs delays no Stop. Thread-safe.
class RobotWatch {
 public:
  /// The newest state as JSON, or the reason why there is none. `number` rises with each text; 0: no text
  /// yet.
  struct State {
    std::uint64_t number{0};
    std::shared_ptr<const std::string> text{};
  };
  /// The result of the newest Stop that has ended; all Stops with lower numbers have ended too. Empty
  /// `failure`: the arm came to rest.
  struct StopResult {
    std::uint64_t number{0};
    std::string failure{};
  };

  RobotWatch(std::string name, std::unique_ptr<RobotPort> port);
  RobotWatch(const RobotWatch&) = delete;
  RobotWatch& operator=(const RobotWatch&) = delete;
  /// Waits for the port's calls in progress and for requested Stops.
  ~RobotWatch();

  /// Starts both threads. They call `changed` after each new state and each Stop; `changed` must not block.
  /// Call start() once.
  void start(std::function<void()> changed);
  /// Requests the end of both threads, and does not wait. They still carry out a Stop that was requested
  /// before.
  void end();

  [[nodiscard]] const std::string& name() const noexcept { return name_; }
  [[nodiscard]] State newest() const;
  /// Returns the last result of the port's connect(); an empty object before the first.
  [[nodiscard]] nlohmann::json description() const;

  /// Requests a Stop and does not wait. Returns the number of the Stop, to be compared with last_stop().
  std::uint64_t request_stop();
  [[nodiscard]] StopResult last_stop() const;

 private:
  using Clock = std::chrono::steady_clock;

  void run_polls();
  void poll_until_failure();
  void run_stops();
  void publish(nlohmann::json state);
  /// Returns false if the watch is to end.
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
