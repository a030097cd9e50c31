// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "cell/cell_config.h"

namespace CLI {  // NOLINT(readability-identifier-naming): the name of the library
class App;
}

// The common part of a cell's programs: command line, cell.toml, log, signals, exit status.

namespace corbot::cell {

/// The argument CELL, and the options that override values of cell.toml.
struct CellOptions {
  std::filesystem::path file;
  CellOverrides overrides;
  void add_file_to(CLI::App& app);  ///< adds CELL alone
  void add_to(CLI::App& app);
  void add_address_to(CLI::App& app);  ///< adds the options for a client of a running cell
};

/// Returns the options as command-line arguments.
[[nodiscard]] std::vector<std::string> words_of(const CellOptions& options);

struct Program {
  const char* name;   ///< "corbot-store"
  const char* about;  ///< description for --help
  std::function<void(CLI::App&)> add_options{};
  std::function<void(const CellConfig&)> run;
};

/// Throws client::Failure, kUsage, if the cell has no robot `name`, the value of `option`.
void check_robot(const CellConfig& cell, const char* option, const std::string& name);

/// Implements main() of a program. Blocks the signals that end the program. Reads command line and cell.
/// Makes the state directory with mode 0700. Returns the exit status of docs/cli.md, and prints errors on
/// standard error.
[[nodiscard]] int run_program(int argc, char** argv, const Program& program);

/// Makes the directory with mode 0700 if it does not exist. Throws client::Failure on an error, if it belongs
/// to another user, or if others have access.
void make_private_directory(const std::filesystem::path& directory);

}  // namespace corbot::cell
