// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <list>
#include <string>

#include "cli/supervise/child.h"

namespace corbot::cli {

/// The terminal of `corbot up`: Enter, or space or 's' before it, stops the arm. By a `corbot stop` of its own,
/// so nothing that hangs there holds up the supervisor.
class Console {
 public:
  /// Does nothing where standard input is no terminal, or something else reads it.
  Console(std::string robot, bool reads_input);

  /// To be polled for input; −1: there is none, or this process is in the background and may not read.
  [[nodiscard]] int fd() const;
  /// Handles what was typed, and what became of the stops.
  void step();

  /// What a person should know of it; empty where it does nothing.
  [[nodiscard]] std::string hint() const;

 private:
  void handle(const std::string& line);
  void stop();

  std::string robot_;
  bool open_;
  std::string typed_;
  std::list<Child> stops_;  ///< under way
};

}  // namespace corbot::cli
