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

/// Brings a device slowly to where the cycle holds the arm: by its own interpolation, or in small steps from
/// where its servos are. Servos without pulses get their first ones one after another. Of the thread that serves
/// the device; every failure throws DeviceError.
class Approach {
 public:
  using Clock = std::chrono::steady_clock;
  /// Sleeps until then; false when the end was asked for meanwhile.
  using Pause = std::function<bool(Clock::time_point)>;
  /// Whether nothing may move now, by this newest frame and all inputs.
  using IsStopped = std::function<bool(const ServoFrame& newest)>;
  /// Is given where the cycle is to begin, step by step: of pulses the newest; of what measures the target that it is held at,
  /// which is no measurement of that instant.
  using Report = std::function<void(const BusReading&)>;

  enum class Outcome {
    kThere,    ///< at the newest frame
    kStopped,  ///< on the way: what moved is halted
    kEnd,      ///< likewise; the end was asked for
  };

  /// `stagger`: between the first pulses of two servos. All that it is given by reference must outlive it.
  Approach(const ArmModel& arm, BusDevice& device, FrameSender& sender, NewestFrame& newest,
           std::chrono::milliseconds stagger, IsStopped is_stopped, Report report, Pause pause);

  /// A drive that a person or a load turns further than this (near_q() of it, where the joint slides) while it is being energised at a
  /// start has no start there.
  static constexpr double kMostTurned_rad = to_radians(3.0);

  /// To the newest frame. What measures is held at the target that it got with its energy until the cycle's set-points begin there, so that
  /// nothing is driven back. At a start there is no cycle yet: `found` is what was measured then, before the energy.
  Outcome run(const std::optional<BusReading>& found = std::nullopt);
  /// Ends the motion by itself that a run() which has failed may have left the device in.
  void halt_left_over();

 private:
  /// Until then, or until a stop or the end.
  [[nodiscard]] Outcome wait_until(Clock::time_point due);
  /// To the servos that have none, by this reading, but the last: `frame` has those of all.
  [[nodiscard]] Outcome give_first_pulses(const ServoFrame& frame, const BusReading& reading);
  /// Puts what the device says into `from`; a servo that is off keeps what it was sent last.
  void begin_at(const BusReading& reading, ServoFrame& from) const;
  void check_not_turned(const BusReading& found, const BusReading& now) const;
  /// At `from`, until the newest frame is there; meanwhile this reading is reported. One beyond its range has no end but a
  /// stop.
  [[nodiscard]] Outcome hold_until_followed(const ServoFrame& from, const BusReading& reading);
  [[nodiscard]] bool is_beyond_range(const BusReading& reading) const;
  [[nodiscard]] bool begins_at(const ServoFrame& from, const ServoFrame& newest) const;
  /// In small steps from `at`, where the servos rest. A stop on the way slows them down.
  [[nodiscard]] Outcome ramp_to_newest(ServoFrame at, const std::optional<BusReading>& held);
  /// Until the device has interpolated its way to the newest frame, were that changed meanwhile.
  [[nodiscard]] Outcome await_interpolation(ServoFrame newest);

  const ArmModel& arm_;
  BusDevice& device_;
  FrameSender& sender_;
  NewestFrame& newest_;
  const std::chrono::milliseconds stagger_;
  const IsStopped is_stopped_;
  const Report report_;
  const Pause pause_until_;
  bool may_be_moving_{false};  ///< the device, by itself; also after a run() that has failed
};

}  // namespace corbot::rt
