// SPDX-License-Identifier: Apache-2.0
#include "cli/supervise/up.h"

#include <fmt/format.h>
#include <sys/un.h>
#include <unistd.h>

#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <memory>
#include <optional>
#include <utility>

#include "cli/arm/doubts.h"
#include "cli/supervise/console.h"
#include "cli/supervise/report.h"
#include "cli/supervise/robot_children.h"
#include "cli/supervise/robot_processes.h"
#include "cli/supervise/state_lock.h"
#include "cli/supervise/supervisor.h"
#include "client/explain.h"
#include "client/failure.h"
#include "config/load_profile.h"
#include "config/profile_edit.h"
#include "net/ports.h"
#include "shm/channel_client.h"
#include "shm/run_directory.h"
#include "shm/segment_error.h"

namespace corbot::cli {

using client::ExitCode;
using client::Failure;
using client::printable;
using client::RobotState;
using net::split_endpoint;

namespace {

namespace fs = std::filesystem;

constexpr int kEndingWithin_ms = 2000;

/// The naming service's log; removed with this object.
class LogDirectory {
 public:
  LogDirectory() {
    std::string path = (fs::temp_directory_path() / "corbot-names-XXXXXX").string();
    if (::mkdtemp(path.data()) == nullptr) throw Failure(ExitCode::kInternal, path + ": cannot be made");
    path_ = path;
  }
  LogDirectory(const LogDirectory&) = delete;
  LogDirectory& operator=(const LogDirectory&) = delete;
  ~LogDirectory() {
    std::error_code ignored;
    fs::remove_all(path_, ignored);
  }
  [[nodiscard]] std::string path() const { return path_.string(); }

 private:
  fs::path path_;
};

/// A profile and its source text, which the processes get, too.
struct ProfileText {
  std::string text;
  Profile profile;
};

ProfileText read_profile(const std::string& file) {
  try {
    std::string text = read_profile_text(file);
    Profile profile = parse_profile(text, file);
    return {with_urdf_text(text, file), std::move(profile)};
  } catch (const std::runtime_error& error) {
    throw Failure(ExitCode::kUsage, error.what());
  }
}

void check_free(const std::string& host, int port, const std::string& fix) {
  const std::string why = client::endpoint_fault(host, port);
  if (!why.empty()) throw Failure(ExitCode::kInternal, fmt::format("{}: {}", why, fix));
}

/// Returns the reference of the naming service at this port.
std::string naming_reference(int port) { return fmt::format("corbaloc::127.0.0.1:{}/NameService", port); }

void check_unix_path(const UpOptions& options) {
  constexpr std::size_t kMostBytes = sizeof(sockaddr_un::sun_path) - 1;
  const fs::path path = options.unix_path;
  if (path.empty()) return;
  const auto refuse = [&](const std::string& why) {
    throw Failure(ExitCode::kUsage, fmt::format("--unix {}: {}", printable(options.unix_path), why));
  };
  if (options.orb == "orbit2") refuse("ORBit2 listens on one address: leave out --orb orbit2");
  if (!path.is_absolute()) refuse("write an absolute path, by which clients find the socket");
  if (path.native().size() > kMostBytes)
    refuse(fmt::format("the path has {} bytes, at most {}", path.native().size(), kMostBytes));
  if (::access(path.parent_path().c_str(), W_OK) != 0)
    refuse(fmt::format("this user cannot create files in {}: choose another directory",
                       printable(path.parent_path().string())));
}

/// Returns the plan of the start, from the command line and the profile.
RobotState plan(const UpOptions& options, const Profile& profile) {
  RobotState state;
  state.name = options.name.empty() ? profile.name : options.name;
  if (!is_name(state.name)) {
    throw Failure(ExitCode::kUsage, fmt::format("--name '{}': {}", printable(state.name), name_rule()));
  }
  if (options.simulated && profile.backend.kind != "loopback") {
    throw Failure(ExitCode::kUsage, fmt::format("--simulated: backend.kind of {} is \"{}\", which drives a "
                                                "device: write \"loopback\" in a copy of the profile",
                                                printable(options.profile), profile.backend.kind));
  }
  state.pid = ::getpid();
  state.profile = fs::absolute(options.profile).string();
  state.endpoint =
      options.endpoint.empty() ? net::endpoint_text(profile.endpoint_host, profile.port) : options.endpoint;
  state.orb = options.orb;
  check_unix_path(options);
  if (state.orb == "orbit2" && !find_program(kOrbit2Servant)) {
    throw Failure(ExitCode::kUsage,
                  fmt::format("--orb orbit2: the program {} is missing, because this corbot was built "
                              "without ORBit2: leave out --orb to run on omniORB",
                              kOrbit2Servant));
  }
  return state;
}

/// Claims the name for this supervisor. Processes that hold it, wherever their files are, are left alone, or
/// ended with --replace.
StateLock take_name(const std::string& name, bool replace) {
  if (replace) {
    if (client::is_up(name)) down(name, "");
    std::fflush(stdout);
    end_robot(name);
  }
  // The processes of a supervisor that was killed end by themselves: wait briefly for that.
  auto processes = find_robot_processes(name);
  for (int waited_ms = 0; waited_ms < kEndingWithin_ms && !processes.empty() && !client::is_up(name);
       waited_ms += 100) {
    ::usleep(100'000);
    processes = find_robot_processes(name);
  }
  auto lock = StateLock::acquire(name);
  if (lock && processes.empty()) return std::move(*lock);
  const auto other = lock ? std::nullopt : client::read_state(name);
  const std::string holder =
      other ? fmt::format("corbot up (pid {}), {}", other->pid, other->endpoint) : describe(processes);
  const std::string fix =
      lock ? "end that process first" : fmt::format("end it with 'corbot down --name {}'", name);
  const std::string other_fix =
      replace ? "try again, for another start came first" : "let --replace end it first";
  throw Failure(
      ExitCode::kInternal,
      fmt::format("'{}' is already running{}: {}, {}, or give the new robot another name with --name", name,
                  holder.empty() ? "" : fmt::format(": {}", holder), fix, other_fix));
}

void announce(const RobotState& state, int naming_port, const std::string& position, const Console& console) {
  report(fmt::format("position: {}", printable(position)));
  report(fmt::format("{} is up at {}", state.name, state.address));
  if (naming_port > 0)
    report(fmt::format("and, once the servant has its name, at corbaname::127.0.0.1:{}#Robots/{}.Robot",
                       naming_port, state.name));
  report(fmt::format(
      "try: corbot status, corbot ready, corbot run PROGRAM; {}Ctrl-C here or 'corbot down' ends it",
      console.hint()));
}

/// The files with which commands find the robot. Their removal does not end the robot.
class StateFiles {
 public:
  explicit StateFiles(StateLock& lock) : lock_(lock) {}
  void write(const RobotState& state) {
    guard([&] { lock_.write(state); });
  }
  void restore() {
    guard([&] { lock_.restore(); });
  }

 private:
  template <class Action>
  void guard(Action&& action) {
    try {
      action();
      if (std::exchange(lost_, false)) log("commands find the robot by its name again");
    } catch (const Failure& failure) {
      if (!std::exchange(lost_, true))
        log(fmt::format("commands cannot find the robot by its name: {}", failure.what()));
    }
  }
  StateLock& lock_;
  bool lost_{false};
};

/// Stops the arm by the stop segment of the task, whatever holds the servant.
class EndingStop {
 public:
  explicit EndingStop(std::string robot) : robot_(std::move(robot)) {}
  /// Stops what moves, and what a servant that hangs has begun since the previous request. Does not wait for
  /// rest; a frozen task delays the first request by up to 3 s.
  void request(pid_t task) noexcept {
    if (!has_begun_) connect(task);
    has_begun_ = true;
    if (port_) port_->request();
  }

 private:
  void connect(pid_t task) noexcept {
    try {
      if (StopPort port = StopPort::of(robot_); port.task_pid() == task) port_.emplace(std::move(port));
    } catch (const SegmentError& error) {  // without a task nothing moves
      if (error.kind() != SegmentError::Kind::kAbsent) log(error.what());
    } catch (const std::exception& error) {
      log(error.what());
    }
  }
  std::string robot_;
  bool has_begun_{false};
  std::optional<StopPort> port_;
};

/// Supervises until a signal requests the end. Throws Failure.
void supervise(const UpOptions& options, const Profile& profile, RobotState& state, StateLock& lock,
               ServiceManager& manager, const LogDirectory* log_directory) {
  std::string position;
  StateFiles files(lock);
  Console console(state.name, !options.until_eof);
  bool announced = false;
  EndingStop stop(state.name);
  Supervisor* running = nullptr;
  Supervisor supervisor({.notify_path = lock.notify_path(),
                         .manager = &manager,
                         .attempts = profile.supervisor.attempts,
                         .on_change =
                             [&] {
                               state.rt_pid = running->pid_of(kRealTimeTask);
                               state.servant_pid = running->pid_of(kServant);
                               files.write(state);
                             },
                         .until_eof = options.until_eof,
                         .input_fd = [&] { return console.fd(); },
                         .on_step =
                             [&] {
                               files.restore();
                               console.step();
                               if (announced && running->all_ready()) manager.feed();
                             },
                         .on_ending = [&] { stop.request(running->pid_of(kRealTimeTask)); }});
  running = &supervisor;
  bool going = true;
  if (log_directory != nullptr) {
    going = supervisor.start(naming_service(options.naming_port, log_directory->path()));
    state.naming = naming_reference(options.naming_port);
  }
  going = going && supervisor.start(real_time_task(options, state, profile, position)) &&
          supervisor.start(servant(options, state, profile.supervisor));
  if (options.panel_port) going = going && supervisor.start(panel({state.name}, *options.panel_port));
  if (going) {
    announce(state, options.naming_port, position, console);
    announced = true;
    manager.ready(fmt::format("{} is up at {}", state.name, state.address));
    while (supervisor.step()) {
    }
  }
  manager.ending();
  report(fmt::format("ending {}{}", state.name, console.end_hint()));
  supervisor.stop_all();
}

/// Removes, at the end of its scope, the socket of a real-time task that had to be killed.
struct SocketRemover {
  const std::string& name;
  ~SocketRemover() { remove_left_behind(name); }
};

}  // namespace

void up(const UpOptions& options) {
  ServiceManager manager;
  ProfileText read = read_profile(options.profile);
  RobotState state = plan(options, read.profile);
  std::string why;
  const auto endpoint = split_endpoint(state.endpoint, &why);
  if (!endpoint) throw Failure(ExitCode::kUsage, fmt::format("--endpoint: {}", printable(why)));
  const auto check_endpoint = [&] {
    check_free(endpoint->first, endpoint->second, "choose another with --endpoint HOST:PORT");
  };
  const auto check_naming = [&] {
    if (options.naming_port > 0)
      check_free("127.0.0.1", options.naming_port, "choose another with --naming PORT");
  };
  if (options.panel_port) (void)panel_program();
  // Refuses what it can before the present robot is ended, which may have these ports itself.
  const auto replaced = options.replace ? client::read_state(state.name) : std::nullopt;
  const auto present = replaced ? split_endpoint(replaced->endpoint, &why) : std::nullopt;
  if (present && present->second != endpoint->second) check_endpoint();
  if (replaced && replaced->naming != naming_reference(options.naming_port)) check_naming();
  StateLock lock = take_name(state.name, options.replace);
  check_endpoint();
  check_naming();
  for (const std::string& doubt : doubts_of(read.profile, workspace_of(read.profile.arm)))
    log(fmt::format("{}: {}", printable(options.profile), doubt));
  std::unique_ptr<LogDirectory> log_directory;
  if (options.naming_port > 0) log_directory = std::make_unique<LogDirectory>();
  if (options.panel_port.value_or(0) > 0)
    check_free("127.0.0.1", *options.panel_port, "let the panel take any free one with --panel 0");
  lock.write_profile(std::move(read.text));
  state.profile_in_use = lock.profile_path();
  lock.write(state);
  {
    const SocketRemover remover{state.name};
    supervise(options, read.profile, state, lock, manager, log_directory.get());
  }
  report(fmt::format("{} is down", state.name));
}

}  // namespace corbot::cli
