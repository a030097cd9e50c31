// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "client/local_robots.h"

namespace corbot::cli {

/// The supervisor's files: those with which commands find a running robot, and those that its processes read.
/// The destructor removes all of them.
class StateLock {
 public:
  /// Returns nothing if another supervisor has the name.
  [[nodiscard]] static std::optional<StateLock> acquire(const std::string& name);
  StateLock(StateLock&& other) noexcept;
  StateLock& operator=(StateLock&&) = delete;
  ~StateLock();

  /// Replaces the file atomically: readers see the old or the new one.
  void write(const client::RobotState& state);
  /// Writes the profile as it was at the start, for the processes: an edit takes effect at the next 'corbot
  /// up'.
  void write_profile(std::string text);
  [[nodiscard]] std::string profile_path() const { return (directory_ / (name_ + ".toml")).string(); }

  /// Restores removed files, the directory included. Throws Failure.
  void restore();

  /// Returns the path of the supervisor's socket for its children.
  [[nodiscard]] std::string notify_path() const { return (directory_ / (name_ + ".notify")).string(); }

 private:
  StateLock(std::filesystem::path directory, std::string name, int fd);
  std::filesystem::path directory_;
  std::string name_;
  int fd_;
  std::string state_{};  ///< text of the files
  std::string profile_{};
};

/// Returns the names of the robots that are not up but have files or a socket, sorted.
[[nodiscard]] std::vector<std::string> stale_robots();

/// Removes the files of a supervisor that died, and the socket of a task that was killed. Returns true if
/// there were any. Does nothing while the robot is up.
bool remove_stale(const std::string& name);

}  // namespace corbot::cli
