// SPDX-License-Identifier: Apache-2.0
#include "cli/force_release.h"

#include <fmt/format.h>
#include <signal.h>

#include <chrono>
#include <thread>

#include "cli/supervise/robot_processes.h"
#include "client/failure.h"

namespace corbot::cli {

using client::Client;
using client::ExitCode;
using client::Failure;

namespace {

using Clock = std::chrono::steady_clock;

std::string holder_of(Client& client) {
  const Corbot::ControlInfo_var control = client.call([](auto& arm) { return arm.Control(); });
  return control->holder.in();
}

}  // namespace

std::string release_by_force(Client& client, const std::string& robot, double timeout_s) {
  const auto deadline =
      Clock::now() + std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(timeout_s));
  std::string holder = holder_of(client);
  if (holder.empty())
    throw Failure(ExitCode::kRefused, "no client has control of the arm: there is nothing to release");
  // An older servant, which the signal would kill, does not have this operation either.
  (void)client.call([](auto& arm) { return arm.CycleAge(); });
  if (!signal_servant(robot, SIGUSR1)) {
    throw Failure(
        ExitCode::kRefused,
        fmt::format(
            "the servant of '{}' belongs to another user: only that user and root may end control by force",
            robot));
  }
  while (holder_of(client) == holder) {
    if (Clock::now() > deadline) {
      throw Failure(ExitCode::kUnreachable, fmt::format("'{}' still has control {:g} s after the signal to "
                                                        "the servant: check 'corbot status' and try again",
                                                        client::printable(holder), timeout_s));
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
  return holder;
}

}  // namespace corbot::cli
