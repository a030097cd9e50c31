// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <list>
#include <string>

#include "cli/supervise/child.h"

namespace corbot::cli {

/// The terminal of `corbot up`: Enter, alone or after space or 's', stops the arm. It runs a separate `corbot
/// stop`, so a stop that hangs does not block the supervisor.
class Console {
 public:
  /// Does nothing if standard input is not a terminal, or something else reads it.
  Console(std::string robot, bool reads_input);

  /// Returns the descriptor to poll for input, or −1: there is none, or this process is in the background and
  /// may not read.
  [[nodiscard]] int fd() const;
  /// Handles the input and the results of the stops.
  void step();

  /// Returns a hint for a person, or "" if the console does nothing.
  [[nodiscard]] std::string hint() const;
  /// Returns a hint for the time while the robot is being ended, or "".
  [[nodiscard]] std::string end_hint() const;

 private:
  void handle(const std::string& line);
  void stop();

  std::string robot_;
  bool open_;
  std::string typed_;
  std::list<Child> stops_;  ///< under way
};

}  // namespace corbot::cli
