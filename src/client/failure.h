// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstring>
#include <filesystem>
#include <stdexcept>
#include <string>

namespace corbot::client {

/// The exit codes of `corbot`. corbot(1) documents them; do not renumber.
enum class ExitCode : int {
  kOk = 0,
  kRefused = 1,      ///< the robot refused or failed the motion; a check of `doctor` failed
  kUsage = 2,        ///< wrong command line, wrong line in a program, wrong profile
  kUnreachable = 3,  ///< no such robot, or no reply
  kStopped = 4,      ///< a Stop ended the motion, or Ctrl-C did
  kInternal = 5,     ///< an error of the operating system or the installation
};

/// Ends a command. The text is for a person, says what to do, and needs no prefix.
class Failure : public std::runtime_error {
 public:
  Failure(ExitCode code, const std::string& text) : std::runtime_error(text), code_(code) {}
  [[nodiscard]] ExitCode code() const noexcept { return code_; }

 private:
  ExitCode code_;
};

/// Returns "PATH: No such file or directory"; `error` is an errno.
[[nodiscard]] inline Failure system_failure(const std::filesystem::path& path, int error) {
  return {ExitCode::kInternal, path.string() + ": " + std::strerror(error)};
}

}  // namespace corbot::client
