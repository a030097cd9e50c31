// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "client/local_robots.h"

namespace corbot::cli {

/// The supervisor's side: what commands find of a robot that is up, and what its processes read. All of it
/// goes away with this object.
class StateLock {
 public:
  /// Nothing when another supervisor has the name.
  [[nodiscard]] static std::optional<StateLock> acquire(const std::string& name);
  StateLock(StateLock&& other) noexcept;
  StateLock& operator=(StateLock&&) = delete;
  ~StateLock();

  /// Replaces the file at once: readers see the old or the new one.
  void write(const client::RobotState& state);
  /// The profile as it was at the start, for the processes: an edit takes effect at the next 'corbot up'.
  void write_profile(std::string text);
  [[nodiscard]] std::string profile_path() const { return (directory_ / (name_ + ".toml")).string(); }

  /// Puts back what has been removed, the directory included. Throws Failure.
  void restore();

  /// Where the supervisor's socket for its children belongs.
  [[nodiscard]] std::string notify_path() const { return (directory_ / (name_ + ".notify")).string(); }

 private:
  StateLock(std::filesystem::path directory, std::string name, int fd);
  std::filesystem::path directory_;
  std::string name_;
  int fd_;
  std::string state_{};  ///< text of the files
  std::string profile_{};
};

/// Names of the robots that are not up but have files or a socket, sorted.
[[nodiscard]] std::vector<std::string> stale_robots();

/// Removes the files of a supervisor that died, and the socket of a task that was killed. True when there was
/// something. Does nothing while the robot is up.
bool remove_stale(const std::string& name);

}  // namespace corbot::cli
