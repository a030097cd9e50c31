// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <functional>
#include <optional>
#include <string>

#include "corbot/backend/backend.h"
#include "rt/backends/bus/device_error.h"

namespace corbot::rt {

/// Servo positions as a device reports them, in the order of the frame. They are pulses, or joint values from
/// a drive with an encoder.
struct BusReading {
  enum class Unit { kNothing, kPulses, kJoints };
  Unit unit{Unit::kNothing};
  std::array<double, kMaxServos> value{};  ///< us, or rad or m
  std::optional<double> gripper_us{};      ///< the gripper as a pulse, beside joint values
  double step_us{0.0};                     ///< the smallest difference of pulses that the device reports
};

/// The state of a device's emergency stop input, as the device reports it.
enum class StopInputLevel {
  kReleased,  ///< released, or the device has no input
  kPressed,
  kUnheard,  ///< no report within the device's deadline, or none that can be right
};

/// A servo controller on a bus that may block, served by BusBackend's thread. Nothing here is real-time safe;
/// every failure throws DeviceError.
class BusDevice {
 public:
  BusDevice() = default;
  BusDevice(const BusDevice&) = delete;
  BusDevice& operator=(const BusDevice&) = delete;
  virtual ~BusDevice() = default;

  /// Opens, identifies and sets up the device; energises nothing and moves nothing. Returns a line for the
  /// log: the model, the rate that the bus allows.
  virtual std::string open() = 0;
  /// Gives the servos energy, and holds them at their positions. It does nothing if a pulse is the energy:
  /// the first pulse comes with the first frame. If it takes long, it polls `is_stopped`. On a stop it takes
  /// off the energy given, and returns false.
  virtual bool energise(const std::function<bool()>& is_stopped) {
    (void)is_stopped;
    return true;
  }
  /// Takes the energy off the servos, which are at rest; it can still measure them. False: the device cannot,
  /// and continues sending the last pulses.
  virtual bool de_energise() { return false; }
  /// Ends properly: holding servos go on holding, and wait for no master.
  virtual void close() noexcept = 0;
  /// Closes after a fault that the device or any other part has found, even if the device itself still
  /// replies. A device that can de-energise does so; a device that watches its master continues to.
  virtual void close_after_fault() noexcept { close(); }
  /// Returns the shortest time between two frames that the bus can carry, known after open().
  [[nodiscard]] virtual std::int64_t period_ns() const noexcept = 0;
  /// Returns the best delay of a frame after the cycle's instant, so that none is skipped or sent twice as
  /// the two threads drift. Empty: any time.
  [[nodiscard]] virtual std::optional<std::int64_t> phase_ns() const noexcept { return std::nullopt; }
  /// Returns the longest gap: after a stall the device catches up in steps as long as after its period and,
  /// at most, this gap.
  [[nodiscard]] virtual std::int64_t longest_gap_ns() const noexcept { return 20'000'000; }
  /// Sends a frame. `approach` requests a slow motion to it, from the servos' positions; only a device that
  /// interpolates gets it. False: the device kept the frame back, since it is not known yet to be the same
  /// one that had the frames before.
  virtual bool send(const ServoFrame& frame, bool approach) = 0;
  /// Returns the duration of a slow approach; 0: the device does not interpolate, and ramps there in small
  /// steps.
  [[nodiscard]] virtual std::int64_t approach_ns() const noexcept { return 0; }
  /// Tells whether the servos' pulses are those of the last approach, and writes these pulses into
  /// `on_the_way`. It is called during an approach, so that the limits are not lifted before its end. Empty:
  /// the device does not report it, and its time decides.
  [[nodiscard]] virtual std::optional<bool> has_arrived(BusReading& on_the_way) {
    (void)on_the_way;
    return std::nullopt;
  }
  /// Ends the approach in progress at the servos' present positions. For a device that interpolates.
  virtual void halt() {}
  /// Reads the servos' positions; kNothing if the device has none. It also shows that the device is alive,
  /// energised or not.
  virtual BusReading measure(const ServoFrame& frame) = 0;
  /// Returns the targets that the servos got when energised, or since, for a device that measures: under load
  /// they are a little off. Empty: the device does not report them.
  [[nodiscard]] virtual std::optional<BusReading> held() const { return std::nullopt; }
  /// Tells whether the device has replied since the last call; read after every frame. Only a device that
  /// replies is healthy. A device that is queried less often than every frame reports false in between.
  [[nodiscard]] virtual bool has_answered() noexcept { return true; }
  /// Tells whether measure() gives the joints by encoders; then nothing is approached from a guess.
  [[nodiscard]] virtual bool has_encoders() const noexcept { return false; }
  /// Tells whether the device has an emergency stop input. An input that cannot be read counts as pressed,
  /// also while the device is lost.
  [[nodiscard]] virtual bool has_stop_input() const noexcept { return false; }
  /// Reads the input after every frame. A missing reply is no exception: the input becomes kUnheard after a
  /// deadline that replies to other queries do not prolong.
  virtual StopInputLevel emergency_stop() { return StopInputLevel::kReleased; }
  /// Returns a problem with which the device continues; read after every frame.
  [[nodiscard]] virtual std::optional<DeviceError> warning() { return std::nullopt; }
  /// Sends the last command: servos without pulses, if the profile requires it.
  virtual void relax() = 0;
  /// Returns a line for the operator's log, or an empty one; drained after every frame and after close().
  [[nodiscard]] virtual std::string drain_log() { return {}; }
};

}  // namespace corbot::rt
