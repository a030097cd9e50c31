// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <fmt/format.h>

#include <stdexcept>
#include <string>

#include "support/paths.h"
#include "support/process.h"

namespace corbot::test {

/// Builds examples/java once. Returns why it is unavailable here; empty: built. Throws std::runtime_error.
inline std::string build_java_robot() {
  const RunResult built = run({CORBOT_EXAMPLES "/java/build", CORBOT_CLIENTS_OUT "/java"}, 500);
  if (built.code == 0) return "";
  if (built.code != 77) throw std::runtime_error("examples/java/build: " + built.errors);
  return built.errors;
}

/// Starts the robot, and returns when it serves at its reference.
inline Process start_java_robot(const std::string& servos, int port, const std::string& key) {
  Process robot({CORBOT_CLIENTS_OUT "/java/robot", servos, std::to_string(port), key});
  if (!robot.wait_line("ready ", within(60))) throw std::runtime_error("no Java robot: " + robot.errors());
  return robot;
}
inline std::string java_robot_reference(int port, const std::string& key) {
  return fmt::format("corbaloc::127.0.0.1:{}/{}", port, key);
}

}  // namespace corbot::test
