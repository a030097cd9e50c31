// SPDX-License-Identifier: Apache-2.0
#include "cli/cell/cell_run.h"

#include <fmt/format.h>

#include <atomic>
#include <chrono>
#include <fstream>
#include <memory>
#include <thread>

#include "cli/cell/cell_client.h"
#include "cli/cell/cell_processes.h"
#include "cli/supervise/report.h"
#include "client/explain.h"
#include "client/failure.h"

namespace corbot::cli {

using cell::CellConfig;
using client::ExitCode;
using client::Failure;

namespace {

namespace fs = std::filesystem;
using Clock = std::chrono::steady_clock;

constexpr std::chrono::milliseconds kPoll{250};
constexpr std::chrono::seconds kQuiet{
    3};  // all robots wait and none has a piece: nothing will change any more

CellConfig load(const cell::CellOptions& options) {
  try {
    return cell::load_cell(options.file, options.overrides);
  } catch (const ConfigError& error) {
    throw Failure(ExitCode::kUsage, error.what());
  }
}

/// Simulated pieces begin anew with the scene, and so does their ledger; the previous one is kept beside it.
void begin_ledger(const CellConfig& cell) {
  if (!cell.scene || !cell.store_reference.empty()) return;
  for (const char* suffix : {"", "-wal", "-shm"}) {
    std::error_code ignored;
    const std::string file = cell.ledger.string();
    fs::rename(file + suffix, file + ".previous" + suffix, ignored);
  }
}

/// The last lines of a program's log, for a message.
std::string tail(const fs::path& log) {
  std::ifstream stream(log);
  std::string line;
  std::string last;
  while (std::getline(stream, line)) {
    if (!line.empty()) last = line;
  }
  return last.empty() ? "" : fmt::format("\n  {}: {}", log.string(), client::printable(last));
}

/// Starts the work and follows it, in a thread of its own, since CORBA calls may wait.
class Work {
 public:
  explicit Work(const CellConfig& cell) : cell_(cell), client_(cell), thread_([this] { run(); }) {}
  Work(const Work&) = delete;
  Work& operator=(const Work&) = delete;
  ~Work() { end(); }

  [[nodiscard]] bool has_ended() const { return has_ended_.load(); }
  /// Why it ended early; nothing where it is done, or goes on.
  [[nodiscard]] const std::optional<Failure>& failure() const { return failure_; }
  [[nodiscard]] CellClient& client() { return client_; }
  void end() {
    asked_to_end_ = true;
    if (thread_.joinable()) thread_.join();
  }

 private:
  void run() {
    try {
      client_.start_work();
      while (!asked_to_end_ && !is_done()) std::this_thread::sleep_for(kPoll);
    } catch (const Failure& failure) {
      failure_.emplace(failure);
    }
    has_ended_ = true;
  }

  bool is_done() {
    const auto state = client_.state();
    bool all_wait = true;
    for (CORBA::ULong i = 0; i < state->robots.length(); ++i) {
      const Corbot::RobotWork& work = state->robots[i];
      const std::string text = fmt::format("{}: {}", work.robot.in(), client::printable(work.text.in()));
      if (work.state == Corbot::WorkStopped) throw Failure(ExitCode::kStopped, text);
      if (work.state == Corbot::WorkAttention) throw Failure(ExitCode::kRefused, text);
      all_wait = all_wait && work.state == Corbot::WorkWaiting;
    }
    if (!all_wait || !client_.has_no_transfer()) {
      quiet_since_ = Clock::now();
      return false;
    }
    if (cell_.scene && static_cast<int>(state->placed) >= cell_.scene->pieces) return true;
    return Clock::now() - quiet_since_ > kQuiet;
  }

  const CellConfig& cell_;
  CellClient client_;
  std::atomic<bool> asked_to_end_{false};
  std::atomic<bool> has_ended_{false};
  std::optional<Failure> failure_;
  Clock::time_point quiet_since_{Clock::now()};
  std::thread thread_;
};

std::optional<SceneEnd> read_scene_end(const CellConfig& cell) {
  std::ifstream stream(scene_output(cell));
  std::string line;
  std::optional<SceneEnd> end;
  while (std::getline(stream, line)) {
    if (auto found = parse_scene_end(line)) end = found;
  }
  return end;
}

std::string done_so_far(const CellConfig& cell, Work& work) {
  try {
    const int placed = work.client().placed();
    return cell.scene ? fmt::format("{} of {} pieces are done", placed, cell.scene->pieces)
                      : fmt::format("{} pieces are done", placed);
  } catch (const Failure&) {
    return "the store did not say how many pieces are done";
  }
}

/// The processes of one cell while it runs.
class Run {
 public:
  Run(const CellConfig& cell, const cell::CellOptions& options)
      : cell_(cell),
        options_(options),
        supervisor_({.notify_path = (cell.state_directory / "notify.sock").string(),
                     .on_change = [this] { check_restarts(); }}) {}

  /// Until the work is done, a fault ends it, or a signal asks for the end.
  void go() {
    for (Supervisor::Spec& spec :
         cell_processes(cell_, options_, [](const std::string& line) { report(line); }))
      if (!start(std::move(spec))) throw Failure(ExitCode::kStopped, "stopped before the work began");
    report(fmt::format("{} runs: coordinator at {}, logs in {}", cell_.name, cell_.coordinator_uri(),
                       cell_.state_directory.string()));
    Work work(cell_);
    bool goes_on = true;
    while (goes_on && !work.has_ended() && restarted_.empty()) goes_on = supervisor_.step();
    work.client().give_up();
    if (cell_.coordinator_reference.empty()) supervisor_.stop_last();  // the arms come to rest
    work.end();
    if (!goes_on) throw Failure(ExitCode::kStopped, "stopped: " + done_so_far(cell_, work));
    if (!restarted_.empty()) {
      throw Failure(ExitCode::kRefused,
                    fmt::format("the {} ended; {}{}", restarted_, done_so_far(cell_, work),
                                tail(log_file(cell_, restarted_))));
    }
    if (work.failure())
      throw Failure(work.failure()->code(),
                    fmt::format("{}\n{}", work.failure()->what(), done_so_far(cell_, work)));
    CellEnd end = work.client().read_end();
    supervisor_.stop_all();
    conclude(std::move(end));
  }

 private:
  bool start(Supervisor::Spec spec) {
    const std::string title = spec.title;
    try {
      if (!supervisor_.start(std::move(spec))) return false;
    } catch (const Failure& failure) {
      throw Failure(failure.code(), failure.what() + tail(log_file(cell_, title)));
    }
    pids_.emplace_back(title, supervisor_.pid_of(title));
    return true;
  }

  /// A process of the cell that ended has lost what it knew: this run ends.
  void check_restarts() {
    for (const auto& [title, pid] : pids_) {
      if (supervisor_.pid_of(title) != pid) restarted_ = title;
    }
  }

  void conclude(CellEnd end) {
    end.has_scene = cell_.scene.has_value();
    if (cell_.scene) {
      end.expected = cell_.scene->pieces;
      end.scene = read_scene_end(cell_);
    }
    const Verdict verdict = judge(cell_, end);
    report(verdict.summary);
    if (verdict.faults.empty()) return;
    std::string text = "the work ended, but not as it should:";
    for (const std::string& fault : verdict.faults) text += "\n  " + fault;
    throw Failure(ExitCode::kRefused, text);
  }

  const CellConfig& cell_;
  const cell::CellOptions& options_;
  std::vector<std::pair<std::string, pid_t>> pids_;
  std::string restarted_;  ///< a process that ended and was started again
  Supervisor supervisor_;
};

}  // namespace

void cell_run(const cell::CellOptions& options) {
  const CellConfig cell = load(options);
  check_installation(cell);
  cell::make_private_directory(cell.state_directory);
  {
    CellClient client(cell);
    client.check_foreign();
  }
  begin_ledger(cell);
  write_profiles(cell);
  Run(cell, options).go();
}

void add_cell(CLI::App& app) {
  CLI::App* cell = app.add_subcommand("cell", "A pick-and-place cell: robots, camera, store, coordinator");
  cell->require_subcommand(1);
  CLI::App* run =
      cell->add_subcommand("run", "Start a cell, supervise it until its work is done, and end it");
  const auto options = std::make_shared<cell::CellOptions>();
  options->add_to(*run);
  run->footer("Ctrl-C stops the arms and ends everything. docs/cell.md describes CELL.");
  run->callback([options] { cell_run(*options); });
}

}  // namespace corbot::cli
