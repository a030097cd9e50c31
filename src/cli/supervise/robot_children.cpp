// SPDX-License-Identifier: Apache-2.0
#include "cli/supervise/robot_children.h"

#include <fmt/format.h>

#include <filesystem>
#include <string_view>
#include <utility>
#include <vector>

#include "cli/supervise/report.h"
#include "client/failure.h"
#include "net/ports.h"

namespace corbot::cli {

using client::RobotState;
using net::listens_on_loopback;

namespace {

namespace fs = std::filesystem;

/// Adds the directory of the last position.
std::vector<std::string> with_state(std::vector<std::string> command, const UpOptions& options) {
  if (!options.state_directory.empty())
    command.insert(command.end(), {"--state-dir", fs::absolute(options.state_directory).string()});
  return command;
}

}  // namespace

Supervisor::Spec naming_service(int port, const std::string& log_directory) {
  const std::string text = fmt::format("{}", port);
  // omniNames refuses -start if a log exists; the log contains the port and all names.
  std::vector<std::string> restart{"omniNames",
                                   "-logdir",
                                   log_directory,
                                   "-errlog",
                                   log_directory + "/errors",
                                   "-ORBendPoint",
                                   "giop:tcp:127.0.0.1:" + text};
  std::vector<std::string> first = restart;
  first.insert(first.begin() + 1, {"-start", text});
  return {
      .title = kNaming, .command = first, .restart_command = restart, .is_ready = [port](const std::string&) {
        return listens_on_loopback(port);
      }};
}

Supervisor::Spec real_time_task(const UpOptions& options, const RobotState& state, const Profile& profile,
                                std::string& position) {
  // The loop stalled for longer than is allowed without a person's Clear.
  const bool is_fault = profile.supervisor.respond_s * 1e9 >= static_cast<double>(profile.gap_fault_ns);
  const std::vector<std::string> after_gap =
      is_fault ? std::vector<std::string>{"--after-gap"} : std::vector<std::string>{};
  return {.title = kRealTimeTask,
          .command = with_state({beside_executable("corbot-rt"), state.profile_in_use, "--name", state.name,
                                 "--realtime", options.realtime},
                                options),
          .is_ready =
              [&position](const std::string& line) {
                constexpr std::string_view kPosition = "position ";
                if (line.starts_with(kPosition)) position = line.substr(kPosition.size());
                return line.starts_with("ready");
              },
          .respond_s = profile.supervisor.respond_s,
          .examine_with = fmt::format("corbot doctor {}", options.profile),
          .after_unresponsive = after_gap};
}

Supervisor::Spec servant(const UpOptions& options, RobotState& state, const SupervisorOptions& times) {
  const std::string program = state.orb == "orbit2" ? kOrbit2Servant : "corbot-servant";
  std::vector<std::string> command{
      beside_executable(program), state.profile_in_use, "--name", state.name, "--endpoint", state.endpoint};
  if (!options.unix_path.empty()) command.insert(command.end(), {"--unix", options.unix_path});
  if (!state.naming.empty()) command.insert(command.end(), {"--naming", state.naming});
  return {.title = kServant,
          .command = with_state(command, options),
          .is_ready =
              [&state](const std::string& line) {
                constexpr std::string_view kReady = "ready ";
                if (!line.starts_with(kReady)) return false;
                state.address = line.substr(kReady.size());
                return true;
              },
          .respond_s = times.respond_s};
}

std::string panel_program() {
  const auto path = find_program("corbot-panel");
  if (path) return *path;
  throw client::Failure(
      client::ExitCode::kUsage,
      "the program corbot-panel is missing, because this corbot was built without Boost: leave out --panel");
}

Supervisor::Spec panel(std::vector<std::string> shown, int port) {
  shown.insert(shown.begin(), {panel_program(), "--port", fmt::format("{}", port)});
  return {.title = kPanel,
          .command = std::move(shown),
          .is_ready =
              [](const std::string& line) {
                if (line.find("#token=") != std::string::npos) report(line);
                return line.starts_with("panel ready");
              },
          .is_needed = false};
}

}  // namespace corbot::cli
