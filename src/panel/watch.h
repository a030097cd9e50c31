// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <condition_variable>
#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <utility>

#include "panel/port.h"
#include "panel/program_runner.h"

namespace corbot::panel {

/// Selects what a watch is for.
enum class Watched { kRobot, kCell };

/// Watches one robot or cell. One thread polls the state, a robot's at 50 Hz and a cell's at 6 Hz, and
/// connects again after a failure. Another thread stops the arms, a third one makes calls, and a fourth one
/// runs programs, so a poll, a call or a program that hangs delays no Stop. Thread-safe.
class Watch {
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

  /// A requested call. `reply` and `failure` are valid when `has_ended`. Empty `failure`: the robot has
  /// accepted it.
  struct Call {
    Call(Order wanted, std::uint64_t last_stop) : order(std::move(wanted)), stops(last_stop) {}
    Order order;
    std::uint64_t stops;  ///< number of the last Stop before the request
    std::atomic<bool> has_ended{false};
    nlohmann::json reply{};
    std::string failure{};
  };

  Watch(std::string name, std::unique_ptr<Port> port, Watched what = Watched::kRobot);
  Watch(const Watch&) = delete;
  Watch& operator=(const Watch&) = delete;
  /// Waits for the port's calls in progress and for requested Stops.
  ~Watch();

  /// Starts the threads. They call `changed` after each new state, Stop and call; `changed` must not block.
  /// Each state has `received_stops` as "stops". Call start() once.
  void start(std::function<void()> changed, const std::atomic<std::uint64_t>& received_stops);
  /// Requests the end of the threads, and does not wait. They still carry out a Stop that was requested
  /// before. If a program runs, they stop the robot.
  void end();

  [[nodiscard]] const std::string& name() const noexcept { return name_; }
  /// Returns the key of the name in all messages.
  [[nodiscard]] const char* key() const noexcept { return what_ == Watched::kRobot ? "robot" : "cell"; }
  [[nodiscard]] bool is_for(Watched what) const noexcept { return what_ == what; }
  [[nodiscard]] std::shared_ptr<const std::string> picture() const { return port_->picture(); }
  [[nodiscard]] State newest() const;
  /// Returns the last result of the port's connect(); an empty object before the first.
  [[nodiscard]] nlohmann::json description() const;

  /// Requests a Stop, which also ends a program, and does not wait. Returns the number of the Stop, to be
  /// compared with last_stop().
  std::uint64_t request_stop();
  [[nodiscard]] StopResult last_stop() const;

  /// Requests a call and does not wait. Returns null if another call is in progress. A Stop that is requested
  /// before the call has ended also stops the motion that the call starts.
  [[nodiscard]] std::shared_ptr<const Call> request_call(Order order);

  /// Starts a program without faults, and does not wait. Returns false if another one still runs.
  [[nodiscard]] bool start_program(client::Program program);

 private:
  using Clock = std::chrono::steady_clock;

  void run_polls();
  void poll_until_failure();
  void run_stops();
  void run_calls();
  /// Tries to stop the arms, after a first failure for eight seconds. Tries only once if a robot does not
  /// answer. Returns why the last try failed; empty: the arms are at rest.
  [[nodiscard]] std::string stop();
  /// Makes the call while the mutex is not locked.
  void make(Call& call);
  void publish(nlohmann::json state);
  /// Returns false if the watch is to end.
  [[nodiscard]] bool sleep_until(Clock::time_point time);

  std::string name_;
  std::unique_ptr<Port> port_;
  Watched what_;
  std::function<void()> changed_;
  const std::atomic<std::uint64_t>* received_stops_{nullptr};

  mutable std::mutex mutex_;
  std::condition_variable wake_;
  bool ending_{false};
  State newest_;
  nlohmann::json description_ = nlohmann::json::object();
  std::uint64_t connections_{0};
  std::uint64_t stops_requested_{0};
  StopResult last_stop_;
  std::shared_ptr<Call> call_;  // null: none is in progress

  ProgramRunner programs_;

  std::thread polls_;
  std::thread stops_;
  std::thread calls_;
};

}  // namespace corbot::panel
