// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "rt/backends/bus/bus_device.h"
#include "rt/backends/bus/lasting_cell.h"

namespace corbot::rt {

/// Sends frames to a device, remembers the last one, and measures how old they are when the device has them.
/// Of the thread that serves the device, but for times().
class FrameSender {
 public:
  /// `device` must outlive it.
  explicit FrameSender(BusDevice& device) : device_(device) {}

  /// False: the device has kept it back. Throws DeviceError.
  bool send(const ServoFrame& frame);
  /// On the way to `frame`: at other positions, or slowly by the device itself. As send().
  bool send_on_the_way(const ServoFrame& frame, bool approach);
  /// servo_count 0: none.
  [[nodiscard]] const ServoFrame& last() const noexcept { return last_; }
  /// From now on the longest age is counted anew.
  void reset_longest_age() noexcept { counted_.age_max_ns = 0; }
  /// Reported from the next frame on.
  void set_speed_ratio(double ratio) noexcept { counted_.speed_ratio = ratio; }
  /// Real-time safe, from any thread.
  [[nodiscard]] BackendTimes times() const noexcept;

 private:
  void count(const ServoFrame& frame);

  BusDevice& device_;
  ServoFrame last_{};
  BackendTimes counted_{};
  LastingCell<BackendTimes> times_;
};

}  // namespace corbot::rt
