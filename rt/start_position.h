// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>

#include "config/profile.h"
#include "corbot/backend/backend.h"
#include "corbot/channel/layout.h"
#include "rt/cycle/cycle.h"
#include "state/position_store.h"

namespace corbot::rt {

/// Where the arm is at the start of the task, and where it was at its end. Set-up and tear-down only. By
/// rank: the segment's position, if its servo map is this one and the servos have had power since, and if no joint is
/// measured away from it; what the device measures or was commanded; the pulses in the segment; the file on disk;
/// and angle 0 where there is nothing. A file that cannot be read as what it shall be is an Error that was not cleared.
class StartPosition {
 public:
  /// `state_directory` empty: the default one. Throws std::invalid_argument for a bad name.
  StartPosition(const Profile& profile, const std::string& robot, const std::string& state_directory);

  /// Decides, and logs the decision and everything that was rejected. `forget`: the file too.
  /// Throws std::runtime_error when a joint is outside its range by what the device says, or by the
  /// last pulses and a servo map that has changed since: every start would move it.
  [[nodiscard]] CycleStart find(const TaskSegment& segment, const DevicePosition& device, bool forget);
  /// The decision in one line of ASCII, for the operator.
  [[nodiscard]] const std::string& text() const noexcept { return text_; }

  /// Writes the last set-point to disk; what goes wrong is logged.
  void save(const TaskSegment& segment) const;

 private:
  void refuse_impossible(const DevicePosition& device) const;
  void refuse_impossible(const Snapshot& last) const;
  [[nodiscard]] std::string moved_since(const Snapshot& last, const DevicePosition& device) const;
  [[nodiscard]] Joints joints_of(const Snapshot& last) const;
  [[nodiscard]] CycleStart decide(const TaskSegment& segment, const DevicePosition& device, bool forget);
  [[nodiscard]] LastPosition by_pulses(const Snapshot& last) const;
  [[nodiscard]] CycleStart left_by(const Snapshot& last, const LastPosition& at);
  /// Of the file.
  struct Saved {
    std::optional<LastPosition> position{};  ///< nothing: there is none, or it was rejected
    bool held{};
    bool in_error{};
    std::string damage{};  ///< why the file proves nothing
  };
  [[nodiscard]] Saved read() const;
  [[nodiscard]] std::optional<CycleStart> from_device(const DevicePosition& device,
                                                      const std::optional<LastPosition>& saved);
  [[nodiscard]] CycleStart assumed(const std::optional<LastPosition>& saved);

  const Profile& profile_;
  const std::uint64_t fingerprint_;  ///< of the servo map and all else that gives a position its meaning
  const bool was_unpowered_;         ///< the servos have been since the last task
  std::string robot_;
  std::optional<PositionStore> store_;  // nothing: no directory is known
  std::string text_;
};

}  // namespace corbot::rt
