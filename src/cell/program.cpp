// SPDX-License-Identifier: Apache-2.0
#include "cell/program.h"

#include <fmt/format.h>
#include <signal.h>
#include <spdlog/sinks/stdout_color_sinks.h>
#include <spdlog/spdlog.h>
#include <sys/stat.h>

#include <cstdio>

#include "client/failure.h"
#include "notify/service_notifier.h"

namespace corbot::cell {

using client::ExitCode;
using client::Failure;

namespace {

sigset_t end_signals() {
  sigset_t signals;
  sigemptyset(&signals);
  for (const int number : {SIGINT, SIGTERM, SIGHUP}) sigaddset(&signals, number);
  return signals;
}

int fail(const Program& program, const std::string& text, ExitCode code) {
  fmt::print(stderr, "{}: {}\n", program.name, text);
  return static_cast<int>(code);
}

}  // namespace

void CellOptions::add_to(CLI::App& app) {
  app.add_option("CELL", file, "description of the cell, a TOML file")->required();
  app.add_option("--name", overrides.name, "name of the cell, instead of the file's");
  app.add_option("--ports", overrides.ports, "the first of the ports in a row that the cell listens on")
      ->check(CLI::Range(1024, 65535));
  app.add_option("--state-dir", overrides.state_directory, "directory of ledger, sockets and logs");
  app.add_option("--pieces", overrides.pieces, "simulated pieces, instead of the file's")
      ->check(CLI::Range(0, 100));
  app.add_option("--seed", overrides.seed, "seed of the simulation, instead of the file's");
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
  std::error_code error;
  std::filesystem::create_directories(directory.parent_path(), error);
  if (!error && ::mkdir(directory.c_str(), 0700) != 0 && errno != EEXIST)
    throw client::system_failure(directory, errno);
  if (error) throw Failure(ExitCode::kInternal, fmt::format("{}: {}", directory.string(), error.message()));
}

int run_program(int argc, char** argv, const Program& program) {
  const sigset_t signals = end_signals();
  pthread_sigmask(SIG_BLOCK, &signals, nullptr);  // before any thread is started: all of them inherit it
  signal(SIGPIPE, SIG_IGN);
  CLI::App app{program.about, program.name};
  CellOptions options;
  options.add_to(app);
  if (program.add_options) program.add_options(app);
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? 0 : static_cast<int>(ExitCode::kUsage);
  }
  spdlog::set_default_logger(spdlog::stderr_color_mt(program.name));
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

void run_until_signal(const std::string& ready_line) {
  ServiceNotifier notifier;
  fmt::print("{}\n", ready_line);
  std::fflush(stdout);
  notifier.ready();
  const sigset_t signals = end_signals();
  const timespec moment{0, 200'000'000};
  while (sigtimedwait(&signals, nullptr, &moment) < 0) notifier.alive();
}

}  // namespace corbot::cell
