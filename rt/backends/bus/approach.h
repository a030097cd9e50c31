// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <optional>

#include "corbot/arm/arm_model.h"
#include "corbot/units.h"
#include "rt/backends/bus/bus_device.h"
#include "rt/backends/bus/frame_sender.h"
#include "rt/backends/bus/newest_frame.h"

namespace corbot::rt {

/// Brings a device slowly to the cycle's position of the arm: by the device's own interpolation, or in small
/// steps from its servos' positions. Servos without pulses get their first pulses one after another. For the
/// thread that serves the device; every failure throws DeviceError.
class Approach {
 public:
  using Clock = std::chrono::steady_clock;
  /// Sleeps until the given time; false if the end was requested meanwhile.
  using Pause = std::function<bool(Clock::time_point)>;
  /// Tells whether motion is forbidden now, by the newest frame and all inputs.
  using IsStopped = std::function<bool(const ServoFrame& newest)>;
  /// Receives step by step the position at which the cycle is to begin. For pulses it is the newest; for a
  /// measuring device it is the held target, which is no measurement of that instant.
  using Report = std::function<void(const BusReading&)>;

  enum class Outcome {
    kThere,    ///< at the newest frame
    kStopped,  ///< stopped on the way; the moving servos are halted
    kEnd,      ///< halted on the way, too; the end was requested
  };

  /// `stagger`: time between the first pulses of two servos. All arguments passed by reference must outlive
  /// it.
  Approach(const ArmModel& arm, BusDevice& device, FrameSender& sender, NewestFrame& newest,
           std::chrono::milliseconds stagger, IsStopped is_stopped, Report report, Pause pause);

  /// The greatest turn by a person or a load while a drive is being energised at a start (near_q() of it for
  /// a sliding joint). A start fails if the drive is turned further.
  static constexpr double kMostTurned_rad = to_radians(3.0);

  /// Goes to the newest frame. A measuring device is held at the targets at which it was energised, until the
  /// cycle's set-points begin there. So nothing is driven back. At a start there is no cycle yet: `found` is
  /// the position measured before energising.
  Outcome run(const std::optional<BusReading>& found = std::nullopt);
  /// Ends a motion of the device's own that a failed run() may have left.
  void halt_left_over();

 private:
  /// Waits until the given time, a stop or the end.
  [[nodiscard]] Outcome wait_until(Clock::time_point due);
  /// Gives first pulses to the servos that have none by this reading, except the last one. `frame` has the
  /// pulses of all.
  [[nodiscard]] Outcome give_first_pulses(const ServoFrame& frame, const BusReading& reading);
  /// Writes the device's report into `from`; a servo that is off keeps its last pulse.
  void begin_at(const BusReading& reading, ServoFrame& from) const;
  void check_not_turned(const BusReading& found, const BusReading& now) const;
  /// Holds `from` until the newest frame is there, and reports this reading meanwhile. For a reading beyond
  /// its range only a stop ends it.
  [[nodiscard]] Outcome hold_until_followed(const ServoFrame& from, const BusReading& reading);
  [[nodiscard]] bool is_beyond_range(const BusReading& reading) const;
  [[nodiscard]] bool begins_at(const ServoFrame& from, const ServoFrame& newest) const;
  /// Ramps in small steps from `at`, the servos' rest position. A stop on the way slows them down.
  [[nodiscard]] Outcome ramp_to_newest(ServoFrame at, const std::optional<BusReading>& held);
  /// Waits until the device has interpolated to the newest frame, even if the frame changed meanwhile.
  [[nodiscard]] Outcome await_interpolation(ServoFrame newest);
  /// Asks an interpolating device whether it has arrived, and reports its pulses on the way.
  [[nodiscard]] std::optional<bool> look();

  const ArmModel& arm_;
  BusDevice& device_;
  FrameSender& sender_;
  NewestFrame& newest_;
  const std::chrono::milliseconds stagger_;
  const IsStopped is_stopped_;
  const Report report_;
  const Pause pause_until_;
  BusReading seen_{};  ///< by the last look()
  Clock::time_point seen_at_{};
  Clock::time_point reported_at_{};
  bool may_be_moving_{false};  ///< the device moves by itself; also after a failed run()
};

}  // namespace corbot::rt
