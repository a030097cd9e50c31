// SPDX-License-Identifier: Apache-2.0
#include "cli/cell/cell_run.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <atomic>
#include <chrono>
#include <fstream>
#include <mutex>
#include <thread>

#include "cell/pictures/scene_motion.h"
#include "cell/running_cells.h"
#include "cell/scene_record.h"
#include "cli/cell/cell_client.h"
#include "cli/cell/cell_directory.h"
#include "cli/cell/cell_pictures.h"
#include "cli/cell/cell_processes.h"
#include "cli/cell/progress.h"
#include "cli/cell/run_table.h"
#include "cli/supervise/report.h"
#include "cli/supervise/robot_children.h"
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
// Times for which all robots must wait. After kQuiet without a piece held nothing will change any more. After
// kStuck nothing will change in any case.
constexpr std::chrono::seconds kQuiet{3};
constexpr std::chrono::seconds kStuck{30};

/// Starts the work, monitors it, and takes the last camera look. Runs in a thread of its own, since CORBA
/// calls may wait.
class Work {
 public:
  explicit Work(const CellConfig& cell) : cell_(cell), client_(cell), thread_([this] { run(); }) {}
  Work(const Work&) = delete;
  Work& operator=(const Work&) = delete;
  ~Work() { end(); }

  [[nodiscard]] bool has_ended() const { return has_ended_.load(); }
  /// Returns why the work ended early, or nothing if it is done. This and the functions below are for use
  /// after the end.
  [[nodiscard]] const std::optional<Failure>& failure() const { return failure_; }
  [[nodiscard]] const CellEnd& found() const { return found_; }
  /// Returns the last reason for which each robot waited, one line each.
  [[nodiscard]] const std::string& waits() const { return waits_; }
  [[nodiscard]] CellClient& client() { return client_; }
  [[nodiscard]] WorkProgress progress() const {
    const std::lock_guard lock(mutex_);
    return progress_;
  }
  [[nodiscard]] double elapsed_s() const {
    return std::chrono::duration<double>(Clock::now() - begin_).count();
  }
  /// Ends the thread. Abandons waiting calls if their program has ended.
  void end() {
    client_.give_up();
    asked_to_end_ = true;
    if (thread_.joinable()) thread_.join();
  }

 private:
  void run() {
    try {
      client_.start_work();
      while (!asked_to_end_ && !is_done()) std::this_thread::sleep_for(kPoll);
      if (!asked_to_end_) found_ = client_.read_end();
    } catch (const Failure& failure) {
      failure_.emplace(failure);
    } catch (const CORBA::Exception& error) {
      failure_.emplace(ExitCode::kInternal, fmt::format("CORBA {}", error._name()));
    }
    has_ended_ = true;
  }

  bool is_done() {
    // read first, since the coordinator also asks the store
    const bool has_transfer = !client_.has_no_transfer();
    const auto state = client_.state();
    take_progress(state);
    bool all_wait = true;
    waits_.clear();
    for (CORBA::ULong i = 0; i < state->robots.length(); ++i) {
      const Corbot::RobotWork& work = state->robots[i];
      const std::string text = fmt::format("{}: {}", work.robot.in(), client::printable(work.text.in()));
      if (work.state == Corbot::WorkStopped) throw Failure(ExitCode::kStopped, text);
      if (work.state == Corbot::WorkAttention) throw Failure(ExitCode::kRefused, text);
      all_wait = all_wait && work.state == Corbot::WorkWaiting;
      waits_ += "\n  " + text;
    }
    const auto now = Clock::now();
    if (!all_wait) stuck_since_ = now;
    if (!all_wait || has_transfer) quiet_since_ = now;
    if (now - stuck_since_ > kStuck)
      throw Failure(ExitCode::kRefused,
                    fmt::format("all robots wait, and no event can end the wait:{}", waits_));
    const bool is_complete = cell_.scene && static_cast<int>(state->placed) >= cell_.scene->pieces;
    return all_wait && !has_transfer && (is_complete || now - quiet_since_ > kQuiet);
  }

  void take_progress(const Corbot::CoordinatorState& state) {
    WorkProgress progress{static_cast<int>(state.placed), {}, {}};
    if (cell_.scene) progress.total = cell_.scene->pieces;
    for (CORBA::ULong i = 0; i < state.robots.length(); ++i)
      progress.robots.push_back(describe(state.robots[i]));
    const std::lock_guard lock(mutex_);
    progress_ = std::move(progress);
  }

  static std::string describe(const Corbot::RobotWork& work) {
    const std::string robot = client::printable(work.robot.in());
    if (work.state == Corbot::WorkWaiting)
      return fmt::format("{} waits: {}", robot, client::printable(work.text.in()));
    if (work.piece != 0) return fmt::format("{} moves piece {}", robot, work.piece);
    return robot + (work.state == Corbot::WorkMoving ? " moves" : " is idle");
  }

  const CellConfig& cell_;
  CellClient client_;
  const Clock::time_point begin_{Clock::now()};
  mutable std::mutex mutex_;  ///< guards the members below
  WorkProgress progress_;
  std::atomic<bool> asked_to_end_{false};
  std::atomic<bool> has_ended_{false};
  std::optional<Failure> failure_;
  CellEnd found_;
  std::string waits_;
  Clock::time_point quiet_since_{Clock::now()};
  Clock::time_point stuck_since_{Clock::now()};
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
    return "how many pieces are done is not known: the store does not reply";
  }
}

/// Returns nothing if the scene has left no readable record: the verdict does not need one.
std::optional<cell::SceneRecord> read_record(const CellConfig& cell) {
  const fs::path path = cell::scene_record_file(cell.state_directory);
  std::ifstream file(path);
  try {
    if (file) return cell::read_scene_record(file);
  } catch (const std::exception& error) {
    report(fmt::format("{}: {}", path.string(), error.what()));
  }
  return std::nullopt;
}

RunFigures figures_of(const CellEnd& end, const std::optional<cell::SceneRecord>& record) {
  RunFigures figures;
  if (record) figures.both_move_share = cell::scene_motion(*record).both_move_share;
  for (const auto& [robot, count] : end.overruns) figures.overruns.emplace_back(robot, count);
  if (!end.scene) return figures;
  figures.nearest_mm = end.scene->nearest_mm;
  figures.overruns.emplace_back(kScene, end.scene->overruns);
  return figures;
}

/// The processes of one cell while it runs.
class Run {
 public:
  Run(const CellConfig& cell, const CellRunOptions& options)
      : cell_(cell),
        options_(options),
        supervisor_({.notify_path = (cell.state_directory / "notify.sock").string(),
                     .restarts = false,
                     .on_change = [this] { find_ended(); },
                     .until_eof = options.until_eof}) {}

  /// Runs until the work is done, a fault ends it, or a signal requests the end.
  void go() {
    for (Supervisor::Spec& spec : cell_processes(cell_, options_.cell, Begin::kAtStart, options_.panel,
                                                 [](const std::string& line) { report(line); })) {
      if (spec.title == kPanel) cell::publish_addresses(cell_, options_.cell.file);
      if (!start(std::move(spec))) throw Failure(ExitCode::kStopped, "stopped before the work began");
    }
    cell::publish_addresses(cell_, options_.cell.file);
    report(fmt::format("{} runs: coordinator at {}, logs in {}", cell_.name, cell_.coordinator_uri(),
                       cell_.state_directory.string()));
    Work work(cell_);
    bool goes_on = true;
    {
      ProgressDisplay display;
      while (goes_on && !work.has_ended() && ended_.empty()) {
        goes_on = supervisor_.step();
        display.show(work.progress(), work.elapsed_s());
      }
    }
    if (cell_.coordinator_reference.empty()) supervisor_.stop_last();  // the arms come to rest
    if (!goes_on || !ended_.empty()) end_early(goes_on, work);
    work.end();
    if (work.failure())
      throw Failure(work.failure()->code(), fmt::format("{}\n{}", work.failure()->what(), stop_early(work)));
    supervisor_.stop_all();
    conclude(work);
  }

 private:
  /// Ends the run early. A waiting call ends with the program that it waits for.
  [[noreturn]] void end_early(bool goes_on, Work& work) {
    work.client().give_up();
    const std::string done = stop_early(work);
    if (!goes_on) throw Failure(ExitCode::kStopped, "stopped: " + done);
    throw Failure(ExitCode::kRefused,
                  fmt::format("{} ended; {}{}", ended_, done, tail_of(log_file(cell_, ended_))));
  }

  /// Returns the progress of the work, for a message. The pictures show the record up to now.
  std::string stop_early(Work& work) {
    std::string done = done_so_far(cell_, work);
    CellEnd end;
    if (!options_.pictures.empty()) end = work.client().read_early_end();
    supervisor_.stop_all();
    if (options_.pictures.empty()) return done;
    end.history.activities = activities();
    const std::optional<cell::SceneRecord> record = cell_.scene ? read_record(cell_) : std::nullopt;
    if (const auto failure = make_pictures({cell_, record, end})) report(failure->what());
    return done;
  }

  bool start(Supervisor::Spec spec) {
    const std::string title = spec.title;
    spec.last_lines = [log = log_file(cell_, title)] { return tail_of(log); };
    if (!supervisor_.start(std::move(spec))) return false;
    if (title != kPanel) pids_.emplace_back(title, supervisor_.pid_of(title));
    return true;
  }

  /// Notes a process of the cell that has ended: it has lost its state, so this run ends.
  void find_ended() {
    for (const auto& [title, pid] : pids_) {
      if (ended_.empty() && supervisor_.pid_of(title) != pid) ended_ = title;
    }
  }

  void conclude(const Work& work) {
    CellEnd end = work.found();
    end.has_scene = cell_.scene.has_value();
    if (cell_.scene) {
      end.expected = cell_.scene->pieces;
      end.scene = read_scene_end(cell_);
    }
    end.history.activities = activities();
    const std::optional<cell::SceneRecord> record = cell_.scene ? read_record(cell_) : std::nullopt;
    for (const std::string& line : run_table(end.history, figures_of(end, record))) report(line);
    const std::optional<Failure> no_pictures = make_pictures({cell_, record, end});
    const Verdict verdict = judge(cell_, end);
    report(verdict.summary);
    if (verdict.faults.empty()) {
      if (no_pictures) throw Failure(*no_pictures);
      return;
    }
    std::string text = "the work ended, but not as it should:";
    for (const std::string& fault : verdict.faults) text += "\n  " + fault;
    throw Failure(ExitCode::kRefused, fmt::format("{}\nthe robots waited:{}", text, work.waits()));
  }

  [[nodiscard]] std::vector<cell::ActivityChange> activities() const {
    if (!cell_.coordinator_reference.empty()) return {};
    return cell::read_activity(cell_.activity_file());
  }

  /// Writes the pictures. The verdict does not need them, so the caller reports a failure after it.
  std::optional<Failure> make_pictures(const RunPictures& pictures) const {
    if (options_.pictures.empty()) return std::nullopt;
    try {
      for (const fs::path& path : write_pictures(options_.pictures, pictures))
        report("picture " + path.string());
    } catch (const Failure& failure) {
      return failure;
    }
    return std::nullopt;
  }

  const CellConfig& cell_;
  const CellRunOptions& options_;
  std::vector<std::pair<std::string, pid_t>> pids_;
  std::string ended_;  ///< the first process that ended by itself
  Supervisor supervisor_;
};

}  // namespace

void cell_run(const CellRunOptions& options) {
  const CellConfig cell = load_for_command(options.cell);
  if (!options.pictures.empty()) prepare_pictures(options.pictures);
  cell::make_private_directory(cell.state_directory);
  const DirectoryLock lock(cell.state_directory);  // before the ports: a running cell uses them
  check_installation(cell, options.panel);
  CellClient(cell).check_foreign();
  begin_anew(cell);
  write_profiles(cell);
  Run(cell, options).go();
}

}  // namespace corbot::cli
