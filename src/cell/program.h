// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <CLI/CLI.hpp>
#include <functional>
#include <string>

#include "cell/cell_config.h"

// All programs of a cell share this around their work: command line, cell.toml, log, signals, exit status.

namespace corbot::cell {

/// CELL and the options that override it, of all programs of a cell.
struct CellOptions {
  std::filesystem::path file;
  CellOverrides overrides;
  void add_file_to(CLI::App& app);  ///< CELL alone
  void add_to(CLI::App& app);
  void add_address_to(CLI::App& app);  ///< what a client of a cell that runs needs
};

/// The same options as words of a command line.
[[nodiscard]] std::vector<std::string> words_of(const CellOptions& options);

struct Program {
  const char* name;   ///< "corbot-store"
  const char* about;  ///< for --help
  std::function<void(CLI::App&)> add_options{};
  std::function<void(const CellConfig&)> run;
};

/// Throws client::Failure, kUsage, where the cell has no robot of the name that this option was given.
void check_robot(const CellConfig& cell, const char* option, const std::string& name);

/// main() of a program: blocks the signals that ask for the end, reads command line and cell, makes the state directory, mode 0700,
/// and returns the exit status of docs/cli.md; what went wrong is on standard error.
[[nodiscard]] int run_program(int argc, char** argv, const Program& program);

/// Prints `ready_line`, reports READY=1 and WATCHDOG=1, and returns when a signal asks for the end.
void run_until_signal(const std::string& ready_line);

/// Makes it with mode 0700 where it is not there. Throws client::Failure, also where it is no directory of this user or others
/// have access.
void make_private_directory(const std::filesystem::path& directory);

}  // namespace corbot::cell
