// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "corbot/backend/backend.h"
#include "corbot/channel/snapshot_cell.h"

namespace corbot::rt {

/// Reads the cycle's newest frame for the thread that serves the device. During a store the cell cannot be
/// read, and a cycle frozen in the middle of one never ends it. The previous frame then stays the newest. So
/// inputs are still read, and the ages of the frame and of a press grow, at whatever instant the cycle froze.
class NewestFrame {
 public:
  /// `cell` must outlive it.
  explicit NewestFrame(const SnapshotCell<ServoFrame>& cell) noexcept : cell_(cell) {}

  /// Valid until the next call. A frame must have been stored before the first call.
  [[nodiscard]] const ServoFrame& read() noexcept {
    (void)cell_.load(last_);
    return last_;
  }

 private:
  const SnapshotCell<ServoFrame>& cell_;
  ServoFrame last_{};
};

}  // namespace corbot::rt
