// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <gtest/gtest.h>

#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "support/paths.h"
#include "support/process.h"

namespace corbot::test {

/// A runtime directory, a robot name and a port of its own for each test.
class CliRig : public ::testing::Test {
 protected:
  CliRig();
  /// Ends the robot and checks that nothing is left behind.
  ~CliRig() override;

  /// `corbot up`, until it reports that the robot is up.
  void up(const std::vector<std::string>& more = {}, const std::string& profile = CORBOT_TEST_PROFILE);
  /// `corbot ARGUMENTS…` to its end.
  RunResult corbot(const std::vector<std::string>& arguments, double seconds = 60);
  /// The same in the background; its standard input is `terminal` where one is given.
  std::unique_ptr<Process> begin(const std::vector<std::string>& arguments, const std::string& terminal = "");
  /// The same under another program, which is given the command as its last arguments.
  std::unique_ptr<Process> begin_in(std::vector<std::string> wrapper,
                                    const std::vector<std::string>& arguments);
  /// Writes a file into the test's directory and returns its path.
  std::string put(const std::string& file, const std::string& text) const;

  /// A profile of an SSC-32 at `line`, which has comments of its own; `more` goes to its options;
  /// `known`: where the arm is at power-up.
  [[nodiscard]] std::string put_ssc32_profile(const std::string& line, const std::string& more = "",
                                              bool known = true) const;

  nlohmann::json status();
  /// The supervisor's state file.
  [[nodiscard]] nlohmann::json state() const;
  bool wait_state(const std::string& word, double seconds = 20);

  std::filesystem::path directory_;
  std::string name_;
  int port_;
  std::unique_ptr<Process> supervisor_;

  /// In which the commands find this robot and no other.
  [[nodiscard]] std::vector<std::string> environment() const;
};

/// Has the process ended? One that waits to be reaped counts as ended.
bool has_ended(pid_t pid);

}  // namespace corbot::test
