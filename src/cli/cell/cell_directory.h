// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>

#include "cell/program.h"
#include "shm/descriptor.h"

// The commands' access to the state directory of a cell. All functions throw client::Failure.

namespace corbot::cli {

[[nodiscard]] cell::CellConfig load_for_command(const cell::CellOptions& options);

/// The lock of the state directory, which one `cell run` or `cell up` can hold at a time.
class DirectoryLock {
 public:
  explicit DirectoryLock(const std::filesystem::path& directory);

 private:
  Descriptor fd_;
};

/// Describes a stop or a pause of an earlier run that still holds the work, or returns "".
[[nodiscard]] std::string hold_note(const cell::CellConfig& cell);

/// Starts new logs for a run. For a simulated world it also starts a new ledger and new robots. The previous
/// ones move to a directory of their own. A world that already runs continues its record. A pause and a stop
/// stay in force.
void begin_anew(const cell::CellConfig& cell, bool world_runs = false);

/// Returns the last lines of a program's log, for a message.
[[nodiscard]] std::string tail_of(const std::filesystem::path& log);

}  // namespace corbot::cli
