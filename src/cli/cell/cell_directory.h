// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <sys/types.h>

#include <filesystem>
#include <optional>
#include <string>

#include "cell/program.h"
#include "shm/descriptor.h"

// The state directory of a cell, as the commands use it. All throw client::Failure.

namespace corbot::cli {

[[nodiscard]] cell::CellConfig load_for_command(const cell::CellOptions& options);

/// The state directory, which one `cell run` or `cell up` has at a time.
class DirectoryLock {
 public:
  explicit DirectoryLock(const std::filesystem::path& directory);

 private:
  Descriptor fd_;
};
/// The process that has the directory; nothing: none has.
[[nodiscard]] std::optional<pid_t> holder_of(const std::filesystem::path& directory);

/// What a person is told of a stop or a pause of an earlier run, which still holds the work; empty: there is none.
[[nodiscard]] std::string hold_note(const cell::CellConfig& cell);

/// Logs begin anew with each run. A simulated world does so, too, with its ledger and its robots. The previous ones are kept in
/// a directory of their own. A world that runs already goes on with its record. A pause and a stop stay in force.
void begin_anew(const cell::CellConfig& cell, bool world_runs = false);

/// The last lines of a program's log, for a message.
[[nodiscard]] std::string tail_of(const std::filesystem::path& log);

}  // namespace corbot::cli
