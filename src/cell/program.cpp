// SPDX-License-Identifier: Apache-2.0
#include "cell/program.h"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <signal.h>
#include <spdlog/spdlog.h>
#include <sys/stat.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <string_view>

#include "client/failure.h"
#include "client/help_formatter.h"
#include "client/number_within.h"
#include "config/similar.h"
#include "log/program_log.h"
#include "notify/end_signals.h"

namespace corbot::cell {

using client::ExitCode;
using client::Failure;

namespace {

int fail(const Program& program, const std::string& text, ExitCode code) {
  const std::string line = fmt::format("{}: {}\n", program.name, text);
  (void)std::fputs(line.c_str(), stderr);  // fmt::print would throw on a full disk
  return static_cast<int>(code);
}

}  // namespace

void CellOptions::add_to(CLI::App& app) {
  add_address_to(app);
  app.add_option("--pieces", overrides.pieces, "Number of simulated pieces, instead of the file's")
      ->check(client::whole_number_within(0, 100))
      ->type_name("N");
  app.add_option("--seed", overrides.seed, "Seed of the simulation, instead of the file's")
      ->check(client::whole_number_within(0, 4294967295))
      ->type_name("S");
}

void CellOptions::add_file_to(CLI::App& app) {
  app.add_option("CELL", file, "Description of the cell, a TOML file")->required()->type_name("");
}

void CellOptions::add_address_to(CLI::App& app) {
  add_file_to(app);
  app.add_option("--name", overrides.name, "Name of the cell, instead of the file's")->type_name("NAME");
  app.add_option("--ports", overrides.ports, "First of the ports in a row that the cell listens on")
      ->check(client::whole_number_within(1024, 65535))
      ->type_name("FIRST");
  app.add_option("--state-dir", overrides.state_directory, "Directory of ledger, sockets and logs")
      ->type_name("DIRECTORY");
}

std::vector<std::string> words_of(const CellOptions& options) {
  std::vector<std::string> words{options.file.string()};
  const auto add = [&](const char* option, const auto& value) {
    if (value) words.insert(words.end(), {option, fmt::format("{}", *value)});
  };
  const CellOverrides& overrides = options.overrides;
  add("--name", overrides.name);
  add("--ports", overrides.ports);
  add("--pieces", overrides.pieces);
  add("--seed", overrides.seed);
  if (!overrides.state_directory.empty())
    words.insert(words.end(), {"--state-dir", std::filesystem::absolute(overrides.state_directory).string()});
  return words;
}

void make_private_directory(const std::filesystem::path& directory) {
  const std::filesystem::path path = directory.has_filename() ? directory : directory.parent_path();
  std::error_code error;
  std::filesystem::create_directories(path.parent_path(), error);
  if (error) throw Failure(ExitCode::kInternal, fmt::format("{}: {}", path.string(), error.message()));
  if (::mkdir(path.c_str(), 0700) == 0) return;
  if (errno != EEXIST) throw client::system_failure(path, errno);
  struct stat found {};
  if (::stat(path.c_str(), &found) != 0) throw client::system_failure(path, errno);
  const auto refuse = [&](const std::string& why) {
    throw Failure(ExitCode::kInternal, path.string() + " " + why);
  };
  if (!S_ISDIR(found.st_mode)) refuse("is no directory: choose another --state-dir");
  if (found.st_uid != ::geteuid()) refuse("belongs to another user: choose another --state-dir");
  if ((found.st_mode & 077) != 0)
    refuse(fmt::format("is open to other users, mode {:03o}: close it with 'chmod 700 {}'",
                       found.st_mode & 0777, path.string()));
}

void check_robot(const CellConfig& cell, const char* option, const std::string& name) {
  if (cell.robot(name) != nullptr) return;
  std::vector<std::string_view> known;
  for (const CellRobot& robot : cell.robots) known.emplace_back(robot.name);
  const std::string_view near = most_similar(name, known, kSimilarKey);
  throw Failure(ExitCode::kUsage, fmt::format("{}: there is no robot '{}' in the cell; there are: {}{}",
                                              option, name, fmt::join(known, ", "),
                                              near.empty() ? "" : fmt::format("; did you mean '{}'?", near)));
}

int run_program(int argc, char** argv, const Program& program) {
  block_end_signals();
  signal(SIGPIPE, SIG_IGN);
  signal(SIGXFSZ, SIG_IGN);  // a file size limit then is an error of write, as a full disk is
  CLI::App app{program.about, program.name};
  app.formatter(std::make_shared<client::HelpFormatter>());
  CellOptions options;
  options.add_to(app);
  if (program.add_options) program.add_options(app);
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? 0 : static_cast<int>(ExitCode::kUsage);
  }
  log_without_waiting(program.name);
  try {
    const CellConfig cell = load_cell(options.file, options.overrides);
    make_private_directory(cell.state_directory);
    program.run(cell);
    return 0;
  } catch (const ConfigError& error) {
    return fail(program, error.what(), ExitCode::kUsage);
  } catch (const Failure& failure) {
    return fail(program, failure.what(), failure.code());
  } catch (const std::exception& error) {
    return fail(program, error.what(), ExitCode::kInternal);
  }
}

}  // namespace corbot::cell
