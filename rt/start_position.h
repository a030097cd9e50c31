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

/// Decides the arm's position at the start of the task, and saves it at the end. Set-up and tear-down only.
/// The sources in the order of rank:
/// * The segment's position, if its servo map is this one, the servos have had power since, and no joint is
///   measured away from it.
/// * The position that the device measures, or was commanded.
/// * The pulses in the segment.
/// * The file on disk.
/// * Angle 0 if there is nothing.
/// A file that cannot be read as a valid one counts as an Error that was not cleared.
class StartPosition {
 public:
  /// `state_directory` empty: the default directory. Throws std::invalid_argument for a bad name.
  StartPosition(const Profile& profile, const std::string& robot, const std::string& state_directory);

  /// Decides, and logs the decision and every rejected source. `forget`: ignores the file, too. Throws
  /// std::runtime_error if a joint is outside its range by the device's report. It also throws for the last
  /// pulses and a servo map that has changed since: every start would move the joint.
  [[nodiscard]] CycleStart find(const TaskSegment& segment, const DevicePosition& device, bool forget);
  /// Returns the decision in one line of ASCII, for the operator.
  [[nodiscard]] const std::string& text() const noexcept { return text_; }

  /// Writes the last set-point to disk, and logs failures.
  void save(const TaskSegment& segment) const;

 private:
  void refuse_impossible(const DevicePosition& device) const;
  void refuse_impossible(const Snapshot& last) const;
  [[nodiscard]] std::string moved_since(const Snapshot& last, const DevicePosition& device) const;
  [[nodiscard]] Joints joints_of(const Snapshot& last) const;
  [[nodiscard]] CycleStart decide(const TaskSegment& segment, const DevicePosition& device, bool forget);
  [[nodiscard]] LastPosition by_pulses(const Snapshot& last) const;
  [[nodiscard]] CycleStart left_by(const Snapshot& last, const LastPosition& at);
  /// The contents of the file.
  struct Saved {
    std::optional<LastPosition> position{};  ///< empty: there is no file, or it was rejected
    bool held{};
    bool in_error{};
    std::string damage{};  ///< the reason why the file proves nothing
  };
  [[nodiscard]] Saved read() const;
  [[nodiscard]] std::optional<CycleStart> from_device(const DevicePosition& device,
                                                      const std::optional<LastPosition>& saved);
  [[nodiscard]] CycleStart assumed(const std::optional<LastPosition>& saved);

  const Profile& profile_;
  /// The servo map and everything else that gives a position its meaning.
  const std::uint64_t fingerprint_;
  const bool was_unpowered_;  ///< the servos have been without power since the last task
  std::string robot_;
  std::optional<PositionStore> store_;  // empty: no directory is known
  std::string text_;
};

}  // namespace corbot::rt
