// SPDX-License-Identifier: Apache-2.0
#include "cli/calibrate/servo_claim.h"

#include <fmt/format.h>

#include <utility>

#include "cli/supervise/robot_processes.h"
#include "client/failure.h"
#include "shm/channel_client.h"
#include "state/position_store.h"

namespace corbot::cli {

using client::ExitCode;
using client::Failure;

StateLock claim_servos(const std::string& name) {
  auto lock = StateLock::acquire(name);
  if (!lock) {
    throw Failure(ExitCode::kInternal,
                  fmt::format("'{}' is up: end it first, with 'corbot down --name {}'", name, name));
  }
  // Two programs must not drive the same servos. A task that listens in another run directory is found by its
  // open files.
  if (task_runs(name) || !find_robot_processes(name).empty()) {
    throw Failure(ExitCode::kInternal,
                  fmt::format("the real-time task of {} is running and holds the servos: end it first, with "
                              "'corbot down --name {}'",
                              name, name));
  }
  return std::move(*lock);
}

namespace {

/// Explains how to end a hold. 'corbot up' refuses drives that are not homed, so a hold could not be cleared
/// before homing.
std::string how_to_clear(const Profile& profile, const std::string& name, const std::string& file) {
  if (profile.backend.kind == "socketcan")
    return fmt::format("Keep clear, and delete {}, which forgets hold and Error", file);
  return fmt::format(
      "Keep clear, type 'corbot up {} --name {}', in another terminal 'corbot clear', then 'corbot down'. "
      "Servos without pulses run at 'clear', at full speed, to where corbot left them. Or delete {}, which "
      "forgets hold, Error and position",
      profile.file, name, file);
}

}  // namespace

std::optional<LastPosition> position_unless_held(const Profile& profile, const std::string& name,
                                                 const std::string& state_directory) {
  const std::filesystem::path directory =
      state_directory.empty() ? default_state_directory() : std::filesystem::path(state_directory);
  if (directory.empty()) return std::nullopt;
  const PositionStore store(directory, name, profile.backend.kind, "unused");
  std::optional<LastPosition> stored;
  bool is_held = false;
  try {
    stored = store.load(profile.arm);
    is_held = stored && stored->held;
  } catch (const PositionError& error) {
    is_held = error.held();
  }
  if (!is_held) return stored;
  throw Failure(ExitCode::kRefused,
                fmt::format("'{}' is held by 'corbot hold': nothing may move until 'corbot clear'. {}", name,
                            how_to_clear(profile, name, store.file().string())));
}

}  // namespace corbot::cli
