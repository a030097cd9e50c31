// SPDX-License-Identifier: Apache-2.0
#include "cli/cell/cell_up.h"

#include <fmt/format.h>
#include <poll.h>
#include <signal.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <cerrno>
#include <optional>
#include <utility>

#include "cell/running_cells.h"
#include "cli/cell/cell_client.h"
#include "cli/cell/cell_directory.h"
#include "cli/cell/cell_processes.h"
#include "cli/cell/cell_world.h"
#include "cli/supervise/report.h"
#include "cli/supervise/robot_children.h"
#include "cli/supervise/service_manager.h"
#include "client/failure.h"
#include "shm/descriptor.h"

namespace corbot::cli {

using cell::CellConfig;
using client::ExitCode;
using client::Failure;

namespace {

constexpr int kDownWithin_ms = 90'000;  // enough for every process to end

/// The processes of a cell that stays up.
class Stay {
 public:
  Stay(const CellConfig& cell, std::optional<CellWorld> world)
      : cell_(cell),
        world_(std::move(world)),
        supervisor_({.notify_path = (cell.state_directory / "notify.sock").string(),
                     .on_change = [this] { check_scene(); },
                     .on_step =
                         [this] {
                           if (is_up_ && supervisor_.all_ready()) manager_.feed();
                         }}) {}

  void go(const cell::CellOptions& options, PanelPort panel) {
    for (Supervisor::Spec& spec : cell_processes(cell_, options, Begin::kAtOnce, panel,
                                                 [](const std::string& line) { report(line); })) {
      const std::string title = spec.title;
      if (title == kPanel) cell::publish_addresses(cell_, options.file);
      if (world_ && title == kScene) continue;
      spec.last_lines = [log = log_file(cell_, title)] { return tail_of(log); };
      if (!supervisor_.start(std::move(spec))) return supervisor_.stop_all();
      if (title == kScene) scene_ = supervisor_.pid_of(kScene);
    }
    cell::publish_addresses(cell_, options.file);
    is_up_ = true;
    manager_.ready(fmt::format("{} is up", cell_.name));
    report(
        fmt::format("{} is up: coordinator at {}, logs in {}; 'corbot cell status' shows it, Ctrl-C or "
                    "'corbot cell down' ends it{}",
                    cell_.name, cell_.coordinator_uri(), cell_.state_directory.string(), hold_note(cell_)));
    while (!has_lost_scene_ && supervisor_.step()) has_lost_scene_ |= world_ && world_->has_ended();
    manager_.ending();
    report(fmt::format("ending {}", cell_.name));
    supervisor_.stop_all();  // the coordinator first: its arms come to rest
    if (has_lost_scene_)
      throw Failure(ExitCode::kInternal, "the simulated world has ended, and with it all pieces" +
                                             (world_ ? "" : tail_of(log_file(cell_, kScene))));
  }

 private:
  void check_scene() { has_lost_scene_ = scene_ && supervisor_.pid_of(kScene) != *scene_; }

  const CellConfig& cell_;
  const std::optional<CellWorld> world_;  ///< not started by this command
  ServiceManager manager_;
  std::optional<pid_t> scene_;
  bool has_lost_scene_{false};
  bool is_up_{false};
  Supervisor supervisor_;
};

}  // namespace

void cell_up(const cell::CellOptions& options, PanelPort panel) {
  const CellConfig cell = load_for_command(options);
  cell::make_private_directory(cell.state_directory);
  const DirectoryLock lock(cell.state_directory);  // before the ports: a running cell uses them
  check_installation(cell, panel);
  CellClient(cell).check_foreign();
  std::optional<CellWorld> world = CellWorld::find(cell);
  if (!world || !world->has_ledger()) begin_anew(cell, world.has_value());
  if (world) world->take_ledger();
  write_profiles(cell);
  Stay(cell, std::move(world)).go(options, panel);
  report(fmt::format("{} is down", cell.name));
}

void cell_down(const cell::CellOptions& options) {
  const CellConfig cell = load_for_command(options);
  const auto nothing_runs = [&] {
    return Failure(ExitCode::kUnreachable, fmt::format("no cell runs in {}", cell.state_directory.string()));
  };
  const auto holder = cell::holder_of(cell.state_directory);
  if (!holder) throw nothing_runs();
  // With a pidfd the signal cannot reach another process that has reused the pid.
  const Descriptor process(static_cast<int>(::syscall(SYS_pidfd_open, *holder, 0)));
  if (process.get() < 0 || cell::holder_of(cell.state_directory) != holder) throw nothing_runs();
  if (::syscall(SYS_pidfd_send_signal, process.get(), SIGTERM, nullptr, 0) != 0 && errno != ESRCH)
    throw client::system_failure(fmt::format("process {}", *holder), errno);
  pollfd end{process.get(), POLLIN, 0};
  if (::poll(&end, 1, kDownWithin_ms) == 0)
    throw Failure(
        ExitCode::kInternal,
        fmt::format("process {} does not end; 'kill -9 {}' ends it and its programs", *holder, *holder));
  fmt::print("{} is down\n", cell.name);
}

}  // namespace corbot::cli
