// SPDX-License-Identifier: Apache-2.0
#include "cli/run_panel.h"

#include <unistd.h>

#include <cerrno>

#include "cli/supervise/child.h"
#include "client/failure.h"

namespace corbot::cli {

using client::ExitCode;
using client::Failure;

void run_panel(std::vector<std::string> arguments) {
  std::string program = "corbot-panel";
  const auto path = find_program(program);
  if (!path)
    throw Failure(ExitCode::kUsage, "there is no corbot-panel here: this corbot was built without Boost");
  std::vector<char*> words{program.data()};
  for (std::string& argument : arguments) words.push_back(argument.data());
  words.push_back(nullptr);
  ::execv(path->c_str(), words.data());
  throw client::system_failure(*path, errno);
}

}  // namespace corbot::cli
