// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "corbot/backend/backend.h"
#include "corbot/channel/snapshot_cell.h"

namespace corbot::rt {

/// The newest frame of the cycle, as the thread that serves the device reads it. While a store is under way there is none
/// to be read, and a cycle that is frozen in the middle of one never ends it: the frame before then goes on being the
/// newest, so that inputs are looked at, and its age and that of a press grow, at whichever instant the cycle stood still.
class NewestFrame {
 public:
  /// `cell` must outlive it.
  explicit NewestFrame(const SnapshotCell<ServoFrame>& cell) noexcept : cell_(cell) {}

  /// Valid until the next call. Something has been stored before the first.
  [[nodiscard]] const ServoFrame& read() noexcept {
    (void)cell_.load(last_);
    return last_;
  }

 private:
  const SnapshotCell<ServoFrame>& cell_;
  ServoFrame last_{};
};

}  // namespace corbot::rt
