// SPDX-License-Identifier: Apache-2.0
#include "cli/run_panel.h"

#include <unistd.h>

#include <cerrno>

#include "cli/supervise/robot_children.h"
#include "client/failure.h"

namespace corbot::cli {

void run_panel(std::vector<std::string> arguments) {
  std::string path = panel_program();
  std::vector<char*> words{path.data()};
  for (std::string& argument : arguments) words.push_back(argument.data());
  words.push_back(nullptr);
  ::execv(path.c_str(), words.data());
  throw client::system_failure(path, errno);
}

}  // namespace corbot::cli
