// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "rt/backends/bus/bus_device.h"
#include "rt/backends/bus/lasting_cell.h"

namespace corbot::rt {

/// Sends frames to a device, remembers the last one, and measures the frames' age when the device has them.
/// For the thread that serves the device, except times().
class FrameSender {
 public:
  /// `device` must outlive it.
  explicit FrameSender(BusDevice& device) : device_(device) {}

  /// Sends a frame. False: the device has kept it back. Throws DeviceError.
  bool send(const ServoFrame& frame);
  /// Sends a step on the way to `frame`: with other positions, or slowly by the device itself. As send().
  bool send_on_the_way(const ServoFrame& frame, bool approach);
  /// Returns the last frame; servo_count 0: none.
  [[nodiscard]] const ServoFrame& last() const noexcept { return last_; }
  /// Restarts the measurement of the longest age.
  void reset_longest_age() noexcept { counted_.age_max_ns = 0; }
  /// Sets the ratio reported from the next frame on.
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
