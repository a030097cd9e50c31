// SPDX-License-Identifier: Apache-2.0
#include "rt/options.h"

#include <CLI/CLI.hpp>
#include <cstdlib>

#include "rt/backends/registry.h"

namespace corbot::rt {

Options parse_options(int argc, char** argv) {
  CLI::App app{"corbot's real-time task: follows accepted motions and drives the servos", "corbot-rt"};
  Options options;
  std::string realtime{"best-effort"};
  app.add_option("PROFILE", options.profile, "profile of the robot, a TOML file")->required();
  app.add_option("--name", options.name, "name of the robot, instead of the profile's");
  app.add_option("--realtime", realtime, "what to do where real-time privileges are missing")
      ->check(CLI::IsMember({"enforce", "best-effort"}))
      ->capture_default_str();
  app.add_option("--state-dir", options.state_directory,
                 "where the last position is saved, instead of $CORBOT_STATE_DIR or ~/.local/state/corbot");
  app.add_option("--servant-user", options.servant_user,
                 "user whose processes may serve this robot, besides this one's own");
  app.add_option("--stop-group", options.stop_group,
                 "group whose members may stop this robot on this machine without its servant");
  app.add_flag(
      "--fresh", options.fresh,
      "forget where the last task left the arm, and its file: it is where the device says, else at angle 0");
  app.add_flag("--after-gap", options.after_gap,
               "begin in Error: the task before did not respond, and was replaced");
  app.footer(fault_controls_help());
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    std::exit(app.exit(error));
  }
  options.enforce = realtime == "enforce";
  return options;
}

}  // namespace corbot::rt
