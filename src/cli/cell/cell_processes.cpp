// SPDX-License-Identifier: Apache-2.0
#include "cli/cell/cell_processes.h"

#include <fmt/format.h>

#include <fstream>
#include <system_error>
#include <utility>

#include "cell/orb_server.h"
#include "cli/supervise/robot_children.h"
#include "client/failure.h"
#include "config/load_profile.h"
#include "config/profile_edit.h"
#include "net/ports.h"

namespace corbot::cli {

using cell::CellConfig;
using cell::CellRobot;
using client::ExitCode;
using client::Failure;

namespace {

namespace fs = std::filesystem;

constexpr double kReadyWithin_s = 30;  // enough beside builds and tests on few processors
constexpr double kRespond_s = 10;
constexpr double kRobotEndsWithin_s = 20;        // a robot ends three processes within five seconds each
constexpr double kCoordinatorEndsWithin_s = 15;  // its robots come to rest, and a camera look ends
constexpr std::string_view kScenePort = "unix:SCENE/NAME.servos";

fs::path profile_path(const CellConfig& cell, const CellRobot& robot) {
  return cell.state_directory / kRobots / (robot.name + ".toml");
}

/// Returns the specification of a program. Its standard error goes to the log; its standard output goes to
/// `output` or to the supervisor. A shell executes the program, which keeps the shell's pid; the pid
/// identifies the sender of READY=1.
Supervisor::Spec spec(const CellConfig& cell, const std::string& title, std::vector<std::string> command,
                      const fs::path& output = {}) {
  const std::string redirections = output.empty() ? "" : " >\"$2\"";
  std::vector<std::string> words{"/bin/sh",
                                 "-c",
                                 "exec 2>>\"$1\"" + redirections + " </dev/null; shift 2; exec \"$@\"",
                                 "corbot",
                                 log_file(cell, title).string(),
                                 output.string()};
  words.insert(words.end(), command.begin(), command.end());
  Supervisor::Spec result{.title = title, .command = std::move(words)};
  result.ready_within_s = kReadyWithin_s;
  result.respond_s = kRespond_s;
  return result;
}

}  // namespace

fs::path log_file(const CellConfig& cell, const std::string& title) {
  return cell.state_directory / (title + ".log");
}
fs::path scene_output(const CellConfig& cell) { return cell.state_directory / "scene.out"; }

void check_installation(const CellConfig& cell, PanelPort panel) {
  for (const char* program : {"corbot-scene", "corbot-store", "corbot-camera", "corbot-coordinator"}) {
    if (!find_program(program))
      throw Failure(ExitCode::kUsage, fmt::format("the program {} is missing, because this corbot was built "
                                                  "without OpenCV, SQLite or libturbojpeg",
                                                  program));
  }
  if (panel) {
    (void)panel_program();
    if (*panel > 0) cell::check_listen("127.0.0.1", *panel, "let the panel take any free one with --panel 0");
  }
  const auto check = [&](int port) { cell::check_listen(cell.host, port); };
  if (cell.store_reference.empty()) check(cell.store_port());
  if (cell.camera_reference.empty()) check(cell.camera_port());
  if (cell.coordinator_reference.empty()) check(cell.coordinator_port());
  for (const CellRobot& robot : cell.robots) {
    if (robot.profile.empty()) continue;
    check(cell.robot_port(robot));
    if (robot.orb == "orbit2" && !find_program(kOrbit2Servant))
      throw Failure(
          ExitCode::kUsage,
          fmt::format(
              "{}: orb = \"orbit2\": the program {} is missing, because this corbot was built without ORBit2",
              robot.name, kOrbit2Servant));
  }
}

std::string profile_text(const CellConfig& cell, const CellRobot& robot) {
  std::string text = with_urdf_text(read_profile_text(robot.profile), robot.profile.string());
  const auto at = text.find(kScenePort);
  if (at != std::string::npos) {
    text.replace(at, kScenePort.size(), "unix:" + cell.servo_socket(robot).string());
  } else if (cell.scene) {
    throw Failure(ExitCode::kUsage,
                  fmt::format("{}: {}.profile: the cell is simulated, so its backend must have port = \"{}\"",
                              robot.profile.string(), cell.key_of(robot), kScenePort));
  }
  return text;
}

void write_profiles(const CellConfig& cell) {
  cell::make_private_directory(cell.state_directory / kRobots);
  for (const CellRobot& robot : cell.robots) {
    if (robot.profile.empty()) continue;
    const std::string text = profile_text(cell, robot);
    std::ofstream file(profile_path(cell, robot));
    if (!(file << text).flush())
      throw client::system_failure(profile_path(cell, robot).string() + ": cannot be written", errno);
  }
}

std::vector<Supervisor::Spec> cell_processes(const CellConfig& cell, const cell::CellOptions& options,
                                             Begin begin, PanelPort panel_port,
                                             std::function<void(const std::string&)> on_event) {
  const auto words = [&](const char* program) {
    std::vector<std::string> command{beside_executable(program)};
    for (const std::string& word : cell::words_of(options)) command.push_back(word);
    return command;
  };
  const fs::path nowhere = "/dev/null";
  std::vector<Supervisor::Spec> specs;
  if (cell.scene) specs.push_back(spec(cell, kScene, words("corbot-scene"), scene_output(cell)));
  for (const CellRobot& robot : cell.robots) {
    if (robot.profile.empty()) continue;
    specs.push_back(
        spec(cell, robot.name,
             {beside_executable("corbot"), "up", profile_path(cell, robot).string(), "--name",
              cell.robot_name(robot), "--endpoint", net::endpoint_text(cell.host, cell.robot_port(robot)),
              "--state-dir", (cell.state_directory / kRobots).string(), "--orb", robot.orb},
             nowhere));
    specs.back().end_within_s = kRobotEndsWithin_s;
  }
  if (cell.store_reference.empty()) specs.push_back(spec(cell, "store", words("corbot-store"), nowhere));
  if (cell.camera_reference.empty()) specs.push_back(spec(cell, "camera", words("corbot-camera"), nowhere));
  if (panel_port) specs.push_back(panel({"--cell", cell.state_directory.string()}, *panel_port));
  if (!cell.coordinator_reference.empty()) return specs;
  std::vector<std::string> coordinator = words("corbot-coordinator");
  if (begin == Begin::kAtOnce) coordinator.emplace_back("--start");
  specs.push_back(spec(cell, kCoordinator, std::move(coordinator)));
  specs.back().end_within_s = kCoordinatorEndsWithin_s;
  specs.back().is_ready = [on_event = std::move(on_event)](const std::string& line) {
    if (line.starts_with("ready ")) return true;
    if (!line.empty()) on_event(line);
    return false;
  };
  return specs;
}

}  // namespace corbot::cli
