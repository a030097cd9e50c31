// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

namespace corbot::cli {

struct UpOptions {
  std::string profile;
  std::string name;      ///< empty: the profile's
  std::string endpoint;  ///< HOST:PORT, empty: the profile's
  int naming_port{0};    ///< 0: no naming service is started
  std::string orb{"omniorb"};
  std::string realtime{"best-effort"};
  std::string state_directory;  ///< of the last position; empty: the default one
};

/// In the foreground until a signal; see corbot(1). Throws Failure.
void up(const UpOptions& options);

/// Ends the supervisor of a robot and waits for its end; removes the stale files of a dead one. `name` may be
/// empty where one robot is up. Throws Failure.
void down(const std::string& name);

}  // namespace corbot::cli
