// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>

#include "config/profile.h"
#include "corbot/backend/backend.h"
#include "corbot/channel/layout.h"
#include "rt/cycle.h"
#include "state/position_store.h"

namespace corbot::rt {

/// Where the arm is at the start of the task, and where it was at its end. Set-up and tear-down only. By
/// rank: what the segment says, what the device measures or has been told, what is on disk, and angle 0 where
/// there is nothing.
class StartPosition {
 public:
  /// `state_directory` empty: the default one. Throws std::invalid_argument for a bad name.
  StartPosition(const Profile& profile, const std::string& robot, const std::string& state_directory);

  /// Decides, and logs what it decided and everything that was not to be believed. `forget`: the file too.
  [[nodiscard]] CycleStart find(const SegmentLayout& segment, const DevicePosition& device, bool forget);
  /// The decision in one line of ASCII, for the operator.
  [[nodiscard]] const std::string& text() const noexcept { return text_; }

  /// Writes the last set-point to disk; what goes wrong is logged.
  void keep(const SegmentLayout& segment) const;

 private:
  [[nodiscard]] std::optional<LastPosition> read() const;
  [[nodiscard]] std::optional<CycleStart> from_device(const DevicePosition& device,
                                                      const std::optional<LastPosition>& kept);
  [[nodiscard]] CycleStart believed(const std::optional<LastPosition>& kept);

  const Profile& profile_;
  std::string robot_;
  std::optional<PositionStore> store_;  // nothing: no directory is known
  std::string text_;
};

}  // namespace corbot::rt
