// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <optional>
#include <string>

#include "corbot/channel/records.h"
#include "state/last_position.h"

namespace corbot {

/// Returns the directory for files that outlive a power-down: $CORBOT_STATE_DIR, $XDG_STATE_HOME/corbot or
/// ~/.local/state/corbot. Returns an empty path if none of them is set.
[[nodiscard]] std::filesystem::path default_state_directory();

/// Returns the kernel's id of this boot, or "" if it has none.
[[nodiscard]] std::string boot_id();

/// Returns a snapshot's position in the form in which it is saved, with the present time. Its values refer to
/// the map of the task that published it.
[[nodiscard]] LastPosition position_of(const Snapshot& snapshot, const std::string& robot,
                                       const std::string& device);

/// The file DIRECTORY/STEM.position, see state_file_stem(). Not real-time safe.
class PositionStore {
 public:
  /// `writer` distinguishes the writing processes, so that none writes into another's new file. Throws
  /// std::invalid_argument for a name that no robot can have.
  PositionStore(const std::filesystem::path& directory, const std::string& robot, const std::string& device,
                const std::string& writer);

  [[nodiscard]] const std::filesystem::path& file() const noexcept { return file_; }
  [[nodiscard]] const std::string& robot() const noexcept { return robot_; }
  [[nodiscard]] const std::string& device() const noexcept { return device_; }

  /// Returns nothing if there is no such file. Throws PositionError for every invalid file, including one
  /// that other users may write to, or that is unreadable.
  [[nodiscard]] std::optional<LastPosition> load(const ArmModel& arm) const;

  /// Replaces the file atomically: a reader always finds the old or the new file, complete. Creates the
  /// directory with mode 0700. Throws std::system_error, and then leaves the file empty if possible: the old
  /// position is no longer true, and an empty file counts as "in Error".
  void save(const LastPosition& position, const ArmModel& arm) const;

 private:
  std::filesystem::path file_;
  std::filesystem::path fresh_;
  std::string robot_;
  std::string device_;
};

}  // namespace corbot
