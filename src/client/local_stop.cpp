// SPDX-License-Identifier: Apache-2.0
#include "client/local_stop.h"

#include <fmt/format.h>

#include <chrono>
#include <thread>

#include "client/failure.h"
#include "client/local_robots.h"
#include "shm/channel_client.h"

namespace corbot::client {

namespace {

using Clock = std::chrono::steady_clock;

/// Returns true if the robot that is up by its state file has another task. CORBOT_RUN_DIR may select a
/// directory where a robot of the same name listens.
bool is_namesake(const std::string& robot, pid_t task) {
  try {
    const auto state = is_up(robot) ? read_state(robot) : std::nullopt;
    return state && state->rt_pid != task;
  } catch (const Failure&) {
    return false;  // the state directory cannot be used: no robot is up there
  }
}

}  // namespace

bool stop_on_this_machine(const std::string& robot, double timeout_s) {
  const auto deadline =
      Clock::now() + std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(timeout_s));
  try {
    StopPort port = StopPort::of(robot);
    if (is_namesake(robot, port.task_pid())) return false;
    port.request();
    for (;;) {
      const StopPort::Outcome outcome = port.outcome();
      if (outcome != StopPort::Outcome::kPending) return outcome == StopPort::Outcome::kAtRest;
      if (Clock::now() > deadline) {
        throw Failure(
            ExitCode::kUnreachable,
            fmt::format("the real-time task of '{}' has not confirmed the stop within {:g} s: it may be "
                        "frozen; 'corbot up' replaces it, an emergency stop cuts the power",
                        robot, timeout_s));
      }
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
  } catch (const SegmentError& error) {
    if (error.kind() == SegmentError::Kind::kAbsent) return false;
    throw Failure(ExitCode::kUnreachable, error.what());
  }
}

void stop_here_or(const std::string& robot, double timeout_s, const std::function<void()>& by_servant) {
  std::string failed;
  try {
    if (!robot.empty() && stop_on_this_machine(robot, timeout_s)) return;
  } catch (const Failure& failure) {
    failed = failure.what();
  }
  try {
    by_servant();
  } catch (const Failure& failure) {
    if (failed.empty()) throw;
    throw Failure(failure.code(), fmt::format("{}; by its servant: {}", failed, failure.what()));
  }
}

}  // namespace corbot::client
