// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "corbot/channel/snapshot_cell.h"
#include "rt/backends/bus/bus_device.h"

namespace corbot::rt {

/// Sends frames to a device, remembers the last one, and measures how old they are when the device has them.
/// Of the thread that serves the device, but for times().
class FrameSender {
 public:
  /// `device` must outlive it.
  explicit FrameSender(BusDevice& device) : device_(device) {}

  /// Throws DeviceError.
  void send(const ServoFrame& frame, bool approach);
  /// servo_count 0: none.
  [[nodiscard]] const ServoFrame& last() const noexcept { return last_; }
  /// From now on the longest age is counted anew.
  void reset_longest_age() noexcept { counted_.age_max_ns = 0; }
  /// Real-time safe, from any thread.
  [[nodiscard]] BackendTimes times() const noexcept;

 private:
  BusDevice& device_;
  ServoFrame last_{};
  BackendTimes counted_{};
  SnapshotCell<BackendTimes> times_;
};

}  // namespace corbot::rt
