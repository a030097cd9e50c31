// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <optional>
#include <string>

#include "corbot/channel/records.h"
#include "state/last_position.h"

namespace corbot {

/// Where corbot saves what outlives a power-down: $CORBOT_STATE_DIR, $XDG_STATE_HOME/corbot or
/// ~/.local/state/corbot; empty where none of them is set.
[[nodiscard]] std::filesystem::path default_state_directory();

/// Id of this run of the machine, as the kernel reports it; empty where it does not.
[[nodiscard]] std::string boot_id();

/// The position that a snapshot holds, as it is saved; written now. The map that gives it its meaning is the
/// one of the task that published it.
[[nodiscard]] LastPosition position_of(const Snapshot& snapshot, const std::string& robot,
                                       const std::string& device);

/// The file DIRECTORY/STEM.position, see state_file_stem(). Not real-time safe.
class PositionStore {
 public:
  /// `writer` tells apart the processes that write, so that neither gets into the other's new file. Throws
  /// std::invalid_argument for a name that no robot can have.
  PositionStore(const std::filesystem::path& directory, const std::string& robot, const std::string& device,
                const std::string& writer);

  [[nodiscard]] const std::filesystem::path& file() const noexcept { return file_; }
  [[nodiscard]] const std::string& robot() const noexcept { return robot_; }
  [[nodiscard]] const std::string& device() const noexcept { return device_; }

  /// Nothing when there is no such file. Throws PositionError for every file that is to be rejected, also one
  /// that other users may write to, or that cannot be read.
  [[nodiscard]] std::optional<LastPosition> load(const ArmModel& arm) const;

  /// Replaces the file: whatever happens meanwhile, a reader finds the old or the new one, whole. Makes the
  /// directory, mode 0700. Throws std::system_error.
  void save(const LastPosition& position, const ArmModel& arm) const;

 private:
  std::filesystem::path file_;
  std::filesystem::path fresh_;
  std::string robot_;
  std::string device_;
};

}  // namespace corbot
