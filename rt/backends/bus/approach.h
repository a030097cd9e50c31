// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstdint>
#include <functional>

#include "corbot/arm/arm_model.h"
#include "corbot/backend/emergency_stop.h"
#include "corbot/channel/snapshot_cell.h"
#include "rt/backends/bus/bus_device.h"
#include "rt/backends/bus/frame_sender.h"

namespace corbot::rt {

/// Brings a device slowly to where the cycle holds the arm: by its own interpolation, or in small steps from
/// where its servos are. Of the thread that serves the device; every failure throws DeviceError.
class Approach {
 public:
  using Clock = std::chrono::steady_clock;
  /// Sleeps until then; false when the end was asked for meanwhile.
  using Pause = std::function<bool(Clock::time_point)>;

  /// All that it is given by reference must outlive it.
  Approach(const ArmModel& arm, BusDevice& device, FrameSender& sender,
           const SnapshotCell<ServoFrame>& newest, EmergencyStop& stop, Pause pause);

  /// To the newest frame; false when the end was asked for meanwhile. `is_starting`: the cycle does not run
  /// yet, so an emergency stop ends the approach; else it interrupts it.
  bool run(bool is_starting);
  /// Before drives are enabled, while a stop is latched; false when the end was asked for meanwhile.
  bool await_release();
  /// Reads the device's stop input, too.
  [[nodiscard]] bool is_stopped(const ServoFrame& newest);

 private:
  [[nodiscard]] bool is_held(const ServoFrame& newest);
  /// In small steps. `is_holding`: the device holds its servos at `at`.
  bool ramp_to_newest(ServoFrame at, bool is_holding);
  /// Until the device has interpolated its way to the newest frame, were that changed meanwhile.
  bool await_interpolation(const ServoFrame& frame);

  const ArmModel& arm_;
  BusDevice& device_;
  FrameSender& sender_;
  const SnapshotCell<ServoFrame>& newest_;
  EmergencyStop& stop_;
  const Pause pause_until_;
  bool is_starting_{false};
  bool may_be_moving_{false};  ///< the device, by itself; also after a run() that has failed
};

}  // namespace corbot::rt
