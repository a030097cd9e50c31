// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "support/emulated_device.h"

namespace corbot::test {

/// corbot-sim with a serial controller, on a pseudo-terminal.
class EmulatedController : public EmulatedDevice {
 public:
  /// `kind`: words for corbot-sim, such as {"ssc32", "--baud", "9600"}. `directory` exists; line and record
  /// are made in it.
  EmulatedController(const std::string& program, const std::vector<std::string>& kind,
                     const std::string& directory)
      : EmulatedDevice(words(program, kind, directory), directory + "/pulses.csv"), line_(line(directory)) {}

  /// The port, as a profile has it.
  [[nodiscard]] const std::string& line() const { return line_; }

 private:
  static std::string line(const std::string& directory) { return directory + "/tty"; }
  static std::vector<std::string> words(const std::string& program, const std::vector<std::string>& kind,
                                        const std::string& directory) {
    std::vector<std::string> command{program};
    command.insert(command.end(), kind.begin(), kind.end());
    command.insert(command.end(), {"--pty", line(directory)});
    return command;
  }

  std::string line_;
};

}  // namespace corbot::test
