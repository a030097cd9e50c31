// SPDX-License-Identifier: Apache-2.0
#include "cli/cell/cell_directory.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <fmt/ranges.h>
#include <sys/file.h>
#include <unistd.h>

#include <cerrno>
#include <deque>
#include <fstream>

#include "cell/running_cells.h"
#include "cell/scene_record.h"
#include "cli/cell/cell_processes.h"
#include "client/explain.h"
#include "client/failure.h"

namespace corbot::cli {

using cell::CellConfig;
using client::ExitCode;
using client::Failure;

namespace fs = std::filesystem;

namespace {

constexpr std::size_t kShownLines = 4;  // of a log

}  // namespace

CellConfig load_for_command(const cell::CellOptions& options) {
  try {
    return cell::load_cell(options.file, options.overrides);
  } catch (const ConfigError& error) {
    throw Failure(ExitCode::kUsage, error.what());
  }
}

DirectoryLock::DirectoryLock(const fs::path& directory)
    : fd_(::open((directory / cell::kLock).c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0600)) {
  if (fd_.get() < 0) throw client::system_failure(directory / cell::kLock, errno);
  if (::flock(fd_.get(), LOCK_EX | LOCK_NB) == 0) {
    const std::string pid = fmt::format("{}\n", ::getpid());
    if (::ftruncate(fd_.get(), 0) == 0 && ::write(fd_.get(), pid.data(), pid.size()) > 0) return;
    throw client::system_failure(directory / cell::kLock, errno);
  }
  throw Failure(
      ExitCode::kInternal,
      fmt::format("a cell runs in {} already: 'corbot cell status' shows it, 'corbot cell down' ends "
                  "it, and --name or --state-dir chooses another directory",
                  directory.string()));
}

std::string hold_note(const cell::CellConfig& cell) {
  std::ifstream stream(cell.hold_file());
  std::string word;
  if (!(stream >> word)) return "";
  return fmt::format("; a {} from before still holds the work: 'corbot cell start' begins it", word);
}

void begin_anew(const CellConfig& cell, bool world_runs) {
  const fs::path previous = cell.state_directory / "previous";
  const std::string ledger = cell.ledger.filename();
  const bool has_ledger = cell.scene && cell.store_reference.empty();
  try {
    fs::remove(cell.state_directory / cell::kAddresses);
    fs::remove_all(previous);
    cell::make_private_directory(previous);
    for (const auto& entry : fs::directory_iterator(cell.state_directory)) {
      const std::string name = entry.path().filename();
      const bool is_world = cell.scene && (name == kRobots || name == scene_output(cell).filename() ||
                                           (name == cell::scene_record_file({}) && !world_runs));
      const bool is_ledger =
          has_ledger && (name == ledger || name == ledger + "-wal" || name == ledger + "-shm");
      if (is_world || is_ledger || entry.path().extension() == ".log" ||
          name == cell.activity_file().filename())
        fs::rename(entry.path(), previous / name);
    }
  } catch (const fs::filesystem_error& error) {
    throw Failure(ExitCode::kInternal, error.what());
  }
}

std::string tail_of(const fs::path& log) {
  std::ifstream stream(log);
  std::deque<std::string> lines;
  for (std::string line; std::getline(stream, line);) {
    if (line.empty()) continue;
    lines.push_back(client::printable(line));
    if (lines.size() > kShownLines) lines.pop_front();
  }
  if (lines.empty()) return "";
  return fmt::format("\n{}:\n  {}", log.string(), fmt::join(lines, "\n  "));
}

}  // namespace corbot::cli
