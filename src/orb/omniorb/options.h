// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

namespace corbot::omni {

/// The servant's command line.
struct Options {
  std::string profile;
  std::string name;              ///< empty: the profile's
  std::string host;              ///< empty: the profile's
  int port{-1};                  ///< −1: the profile's
  std::string unix_path;         ///< empty: no Unix socket
  std::string naming;            ///< corbaloc of a naming service; empty: none
  std::string state_directory;   ///< directory of the last position; empty: the default one
  std::vector<std::string> orb;  ///< -ORB… options, passed on
};

/// Parses the command line. Prints help or a fault and exits if necessary.
Options parse_options(int argc, char** argv);

/// Throws std::runtime_error with address and cause if no server can listen there now.
void check_port(const std::string& host, int port);

}  // namespace corbot::omni
