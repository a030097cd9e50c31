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
  std::string state_directory;   ///< of the last position; empty: the default one
  std::vector<std::string> orb;  ///< -ORB… options, handed through
};

/// Parses. Prints help or what is wrong and leaves the process when the command line asks for that.
Options parse_options(int argc, char** argv);

/// Throws std::runtime_error naming address and cause when nothing can listen there now.
void check_port(const std::string& host, int port);

}  // namespace corbot::omni
