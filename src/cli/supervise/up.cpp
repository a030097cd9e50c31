// SPDX-License-Identifier: Apache-2.0
#include "cli/supervise/up.h"

#include <fmt/format.h>
#include <unistd.h>

#include <cstdio>
#include <cstdlib>
#include <filesystem>

#include "cli/supervise/abandoned_segment.h"
#include "cli/supervise/state_lock.h"
#include "cli/supervise/supervisor.h"
#include "client/explain.h"
#include "client/failure.h"
#include "config/load_profile.h"
#include "net/ports.h"

namespace corbot::cli {

using client::ExitCode;
using client::Failure;
using client::printable;
using client::read_state;
using client::RobotState;
using net::listen_error;
using net::listens_on_loopback;
using net::split_endpoint;

namespace {

namespace fs = std::filesystem;

constexpr const char* kNaming = "naming service";
constexpr const char* kRealTimeTask = "real-time task";
constexpr const char* kServant = "servant";

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

Profile read_profile(const std::string& file) {
  try {
    return load_profile(file);
  } catch (const ConfigError& error) {
    throw Failure(ExitCode::kUsage, error.what());
  }
}

void check_free(const std::string& host, int port, const std::string& fix) {
  if (const std::string why = listen_error(host, port); !why.empty()) {
    throw Failure(ExitCode::kInternal, fmt::format("{}: {}", why, fix));
  }
}

Supervisor::Spec naming_service(int port, const std::string& log_directory) {
  const std::string text = fmt::format("{}", port);
  return {kNaming,
          {"omniNames", "-start", text, "-logdir", log_directory, "-errlog", log_directory + "/errors",
           "-ORBendPoint", "giop:tcp:127.0.0.1:" + text},
          [port](const std::string&) { return listens_on_loopback(port); }};
}

/// Adds the directory of the last position.
std::vector<std::string> with_state(std::vector<std::string> command, const UpOptions& options) {
  if (!options.state_directory.empty())
    command.insert(command.end(), {"--state-dir", fs::absolute(options.state_directory).string()});
  return command;
}

/// `position` receives what the task reports of the arm's position.
Supervisor::Spec real_time_task(const UpOptions& options, const RobotState& state, std::string& position) {
  return {kRealTimeTask,
          with_state({beside_executable("corbot-rt"), state.profile, "--name", state.name, "--realtime",
                      options.realtime},
                     options),
          [&position](const std::string& line) {
            constexpr std::string_view kPosition = "position ";
            if (line.starts_with(kPosition)) position = line.substr(kPosition.size());
            return line.starts_with("ready");
          }};
}

constexpr const char* kOrbit2Servant = "corbot-servant-orbit2";

Supervisor::Spec servant(const UpOptions& options, RobotState& state) {
  const std::string program = state.orb == "orbit2" ? kOrbit2Servant : "corbot-servant";
  std::vector<std::string> command{
      beside_executable(program), state.profile, "--name", state.name, "--endpoint", state.endpoint};
  if (!state.naming.empty()) command.insert(command.end(), {"--naming", state.naming});
  return {kServant, with_state(command, options), [&state](const std::string& line) {
            constexpr std::string_view kReady = "ready ";
            if (!line.starts_with(kReady)) return false;
            state.address = line.substr(kReady.size());
            return true;
          }};
}

void announce(const RobotState& state, const std::string& position) {
  fmt::print("position: {}\n{} is up at {}\n", printable(position), state.name, state.address);
  if (!state.naming.empty()) fmt::print("named Robots/{}.Robot in {}\n", state.name, state.naming);
  fmt::print("try: corbot status, corbot ready, corbot run PROGRAM; Ctrl-C here or 'corbot down' ends it\n");
  std::fflush(stdout);
}

}  // namespace

void up(const UpOptions& options) {
  const Profile profile = read_profile(options.profile);
  RobotState state;
  state.name = options.name.empty() ? profile.name : options.name;
  if (!is_name(state.name)) {
    throw Failure(ExitCode::kUsage, fmt::format("--name '{}': {}", state.name, name_rule()));
  }
  state.pid = ::getpid();
  state.profile = fs::absolute(options.profile).string();
  state.endpoint =
      options.endpoint.empty() ? fmt::format("{}:{}", profile.endpoint_host, profile.port) : options.endpoint;
  state.orb = options.orb;
  if (state.orb == "orbit2" && !find_program(kOrbit2Servant)) {
    throw Failure(
        ExitCode::kUsage,
        fmt::format("--orb orbit2: there is no {} here: this corbot was built without ORBit2; without --orb "
                    "it runs on omniORB",
                    kOrbit2Servant));
  }
  const auto endpoint = split_endpoint(state.endpoint);
  if (!endpoint) {
    throw Failure(ExitCode::kUsage,
                  fmt::format("--endpoint '{}': write HOST:PORT, port 1 to 65535", state.endpoint));
  }

  const auto lock = StateLock::acquire(state.name);
  if (!lock) {
    const auto other = read_state(state.name);
    throw Failure(
        ExitCode::kInternal,
        fmt::format("'{}' is already running{}: end it with 'corbot down --name {}', or give this one "
                    "another name with --name",
                    state.name, other ? fmt::format(" (pid {}, {})", other->pid, other->endpoint) : "",
                    state.name));
  }
  check_free(endpoint->first, endpoint->second, "choose another with --endpoint HOST:PORT");
  std::unique_ptr<LogDirectory> log_directory;
  if (options.naming_port > 0) {
    check_free("127.0.0.1", options.naming_port, "choose another with --naming PORT");
    log_directory = std::make_unique<LogDirectory>();
  }

  {
    std::string position;
    Supervisor* running = nullptr;
    Supervisor supervisor({lock->notify_path(), profile.supervisor.attempts, [&] {
                             state.rt_pid = running->pid_of(kRealTimeTask);
                             state.servant_pid = running->pid_of(kServant);
                             lock->write(state);
                           }});
    running = &supervisor;
    lock->write(state);
    bool going = true;
    if (log_directory) {
      going = supervisor.start(naming_service(options.naming_port, log_directory->path()));
      state.naming = fmt::format("corbaloc::127.0.0.1:{}/NameService", options.naming_port);
    }
    going = going && supervisor.start(real_time_task(options, state, position)) &&
            supervisor.start(servant(options, state));
    if (going) {
      announce(state, position);
      while (supervisor.step()) {
      }
    }
    fmt::print("ending {}\n", state.name);
    std::fflush(stdout);
    supervisor.stop_all();
  }
  remove_abandoned_segment(state.name);  // left by a process that had to be killed
  fmt::print("{} is down\n", state.name);
}

}  // namespace corbot::cli
