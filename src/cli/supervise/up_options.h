// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "cli/supervise/panel_port.h"

namespace corbot::cli {

struct UpOptions {
  std::string profile;
  std::string name;       ///< empty: the profile's
  std::string endpoint;   ///< HOST:PORT, empty: the profile's
  std::string unix_path;  ///< of a Unix socket to listen on as well; may be empty
  int naming_port{0};     ///< 0: no naming service is started
  PanelPort panel_port;
  std::string orb{"omniorb"};
  std::string realtime{"best-effort"};
  bool simulated{false};        ///< refuse a profile that drives a device
  bool until_eof{false};        ///< the end of standard input ends the robot
  bool replace{false};          ///< end the processes under that name
  std::string state_directory;  ///< directory of the last position; empty: the default one
};

}  // namespace corbot::cli
