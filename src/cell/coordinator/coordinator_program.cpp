// SPDX-License-Identifier: Apache-2.0
#include "cell/coordinator/coordinator_program.h"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <memory>
#include <string>
#include <vector>

#include "cell/orb_server.h"
#include "cell/program.h"

namespace corbot::cell {
namespace {

/// Returns the named robots, each once, or all robots if `named` is empty.
std::vector<std::string> robots_of(const CellConfig& cell, const std::vector<std::string>& named) {
  for (const std::string& name : named) check_robot(cell, "--robots", name);
  std::vector<std::string> chosen;
  for (const CellRobot& robot : cell.robots) {
    if (named.empty() || std::find(named.begin(), named.end(), robot.name) != named.end())
      chosen.push_back(robot.name);
  }
  return chosen;
}

void run(const CellConfig& cell, const std::vector<std::string>& named, bool is_to_start,
         const WrapPorts& wrap_ports) {
  const std::vector<std::string> robots = robots_of(cell, named);
  std::unique_ptr<CoordinatorServant> servant;  // must outlive the ORB
  OrbServer server(cell.host, {cell.coordinator_port()});
  servant = std::make_unique<CoordinatorServant>(server.orb(), cell, robots, wrap_ports);
  server.activate(kCoordinatorKey, servant.get());
  if (is_to_start) servant->start_unless_stopped();
  server.serve(kCoordinatorKey);
  fmt::print("stopped, {} pieces placed\n", servant->end());
}

}  // namespace

int coordinator_main(int argc, char** argv, const WrapPorts& wrap_ports) {
  std::vector<std::string> robots;
  bool is_to_start = false;
  const auto add_options = [&](CLI::App& app) {
    app.add_option("--robots", robots, "names of the robots to drive, with commas; all where it is not given")
        ->delimiter(',')
        ->allow_extra_args(false);
    app.add_flag("--start", is_to_start, "begin the work at once, unless a Stop holds it");
  };
  return run_program(argc, argv,
                     {"corbot-coordinator", "Drives the robots of a pick-and-place cell.", add_options,
                      [&](const CellConfig& cell) { run(cell, robots, is_to_start, wrap_ports); }});
}

}  // namespace corbot::cell
