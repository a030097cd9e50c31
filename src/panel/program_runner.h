// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <condition_variable>
#include <functional>
#include <memory>
#include <mutex>
#include <nlohmann/json.hpp>
#include <string>
#include <thread>

#include "client/program.h"
#include "panel/performer.h"

namespace corbot::panel {

/// Runs programs on one robot, one at a time, in a thread of its own. Thread-safe.
class ProgramRunner {
 public:
  /// The runner's thread calls these functions.
  struct Calls {
    /// Connects to the robot. Throws std::exception.
    std::function<std::unique_ptr<Performer>()> connect;
    /// Stops the arm again: a motion may have begun after the Stop that ended the program. It does not wait.
    std::function<void()> stop;
    std::function<void()> ended;  ///< after each program
  };

  explicit ProgramRunner(Calls calls) : calls_(std::move(calls)), thread_([this] { run(); }) {}
  ProgramRunner(const ProgramRunner&) = delete;
  ProgramRunner& operator=(const ProgramRunner&) = delete;
  /// Cancels the program that runs, and waits for its end.
  ~ProgramRunner();

  /// Starts a program without faults. Returns false if another one still runs.
  [[nodiscard]] bool start(client::Program program);
  /// Ends the program after the motion in progress. To be called before the arm is stopped.
  void cancel();
  [[nodiscard]] bool is_running() const;
  /// Returns the program that runs or ran last; null: there was none. Its "state" is "runs", "done",
  /// "stopped" or "failed".
  [[nodiscard]] nlohmann::json state() const;

 private:
  void run();
  void carry_out(const client::Program& program);
  void finish(const char* state, const std::string& text);

  const Calls calls_;
  mutable std::mutex mutex_;
  std::condition_variable wake_;
  bool ending_{false};
  bool running_{false};
  bool cancelled_{false};
  client::Program program_;  // of the thread, while it runs
  std::unique_ptr<Performer> performer_;
  nlohmann::json state_;
  std::thread thread_;  // the last member: it uses the others
};

}  // namespace corbot::panel
