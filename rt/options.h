// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

namespace corbot::rt {

/// The command line of the real-time task.
struct Options {
  std::string profile;
  std::string name;  ///< empty: the profile's
  std::string state_directory;
  std::string servant_user;
  std::string stop_group;
  bool enforce{false};
  bool fresh{false};
  bool after_gap{false};
};

/// Parses the command line. Prints help, or what is wrong, and ends the process then.
Options parse_options(int argc, char** argv);

}  // namespace corbot::rt
