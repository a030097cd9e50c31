// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <optional>
#include <string>

#include "corbot/backend/backend.h"
#include "rt/backends/bus/device_error.h"

namespace corbot::rt {

/// Servo positions as a device reports them, in the order of the frame: as pulses, or, from a drive with an
/// encoder, as joint angles.
struct BusReading {
  enum class Unit { kNothing, kPulses, kJoints };
  Unit unit{Unit::kNothing};
  std::array<double, kMaxServos> value{};  ///< us, or rad
  std::optional<double> gripper_us{};      ///< beside joint angles: the gripper, as a pulse
};

/// A servo controller on a bus that may block: what BusBackend's thread talks to. Nothing here is real-time
/// safe; every failure throws DeviceError.
class BusDevice {
 public:
  BusDevice() = default;
  BusDevice(const BusDevice&) = delete;
  BusDevice& operator=(const BusDevice&) = delete;
  virtual ~BusDevice() = default;

  /// Opens and finds out what it is. Returns a line for the log: the model, the rate that the bus allows.
  virtual std::string open() = 0;
  virtual void close() noexcept = 0;
  /// Shortest time between two frames that the bus can carry, known after open().
  [[nodiscard]] virtual std::int64_t period_ns() const noexcept = 0;
  /// How long after the instant of the cycle a frame is best handed over, so that none is skipped or sent
  /// twice as the two threads drift; nothing: whenever.
  [[nodiscard]] virtual std::optional<std::int64_t> phase_ns() const noexcept { return std::nullopt; }
  /// After a stall the device catches up in steps as long as one after its period and, at most, this.
  [[nodiscard]] virtual std::int64_t longest_gap_ns() const noexcept { return 20'000'000; }
  /// Hands a frame over. `approach` asks for a slow motion to it, from wherever the servos are; only a device
  /// that interpolates is asked.
  virtual void send(const ServoFrame& frame, bool approach) = 0;
  /// How long a slow approach takes; 0: the device does not interpolate, and ramps there in small steps.
  [[nodiscard]] virtual std::int64_t approach_ns() const noexcept { return 0; }
  /// Ends the approach that is under way, where the servos are now. For a device that interpolates.
  virtual void halt() {}
  /// Reads the servos' positions; kNothing where the device has none. Also shows that it is alive.
  virtual BusReading measure(const ServoFrame& frame) = 0;
  /// Whether the device has replied since the last call; read after every frame. Only a device that replies
  /// is healthy; one that is queried less often than every frame reports false in between.
  [[nodiscard]] virtual bool has_answered() noexcept { return true; }
  /// Whether open() lets drives hold their loads; then it waits while an emergency stop is latched.
  [[nodiscard]] virtual bool energises_at_open() const noexcept { return false; }
  /// Whether the device's emergency stop input is active; read after every frame.
  virtual bool emergency_stop() { return false; }
  /// What is wrong with it, though it goes on; read after every frame.
  [[nodiscard]] virtual std::optional<DeviceError> warning() { return std::nullopt; }
  /// The last thing sent: servos without pulses, where the profile says so.
  virtual void relax() = 0;
  /// A line for the operator's log, or empty; drained after every frame and after close().
  [[nodiscard]] virtual std::string drain_log() { return {}; }
};

}  // namespace corbot::rt
