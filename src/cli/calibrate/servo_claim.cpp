// SPDX-License-Identifier: Apache-2.0
#include "cli/calibrate/servo_claim.h"

#include <fmt/format.h>

#include <utility>

#include "cli/supervise/robot_processes.h"
#include "client/failure.h"
#include "shm/channel_client.h"

namespace corbot::cli {

using client::ExitCode;
using client::Failure;

StateLock claim_servos(const std::string& name) {
  auto lock = StateLock::acquire(name);
  if (!lock) {
    throw Failure(ExitCode::kInternal,
                  fmt::format("'{}' is up: end it first, with 'corbot down --name {}'", name, name));
  }
  // Two programs must not drive the same servos. It may listen in another run directory: then it is found by what it has open.
  if (task_runs(name) || !find_robot_processes(name).empty()) {
    throw Failure(ExitCode::kInternal,
                  fmt::format("the real-time task of {} is running and holds the servos: end it first, with "
                              "'corbot down --name {}'",
                              name, name));
  }
  return std::move(*lock);
}

}  // namespace corbot::cli
