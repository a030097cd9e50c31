// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <functional>
#include <optional>
#include <string>

#include "corbot/backend/backend.h"
#include "rt/backends/bus/device_error.h"

namespace corbot::rt {

/// Servo positions as a device reports them, in the order of the frame: as pulses, or, from a drive with an
/// encoder, as joint values.
struct BusReading {
  enum class Unit { kNothing, kPulses, kJoints };
  Unit unit{Unit::kNothing};
  std::array<double, kMaxServos> value{};  ///< us, or rad or m
  std::optional<double> gripper_us{};      ///< beside joint values: the gripper, as a pulse
  double step_us{0.0};                     ///< of pulses: the device tells no smaller differences
};

/// What a device says of its emergency stop input.
enum class StopInputLevel {
  kReleased,  ///< or it has none
  kPressed,
  kUnheard,  ///< it has not said so for longer than the device's deadline, or nothing that can be right
};

/// A servo controller on a bus that may block: what BusBackend's thread talks to. Nothing here is real-time
/// safe; every failure throws DeviceError.
class BusDevice {
 public:
  BusDevice() = default;
  BusDevice(const BusDevice&) = delete;
  BusDevice& operator=(const BusDevice&) = delete;
  virtual ~BusDevice() = default;

  /// Opens, finds out what it is, and sets it up; energises nothing and moves nothing. Returns a line for the
  /// log: the model, the rate that the bus allows.
  virtual std::string open() = 0;
  /// Gives the servos energy, and holds them where they are. Nothing to do where a pulse is the energy: the
  /// first one comes with the first frame. Where that takes a while it asks `is_stopped` again and again, takes off
  /// what it has given when it is so, and returns false.
  virtual bool energise(const std::function<bool()>& is_stopped) {
    (void)is_stopped;
    return true;
  }
  /// Takes the energy off the servos, which are at rest; it can still be measured. False: the device cannot,
  /// and goes on sending the pulses that it was given.
  virtual bool de_energise() { return false; }
  /// At a proper end: what holds goes on holding, and waits for nobody.
  virtual void close() noexcept = 0;
  /// After a fault, whoever has found it, also where the device itself answers: what can take its energy off does so, and
  /// what watches its master goes on with that.
  virtual void close_after_fault() noexcept { close(); }
  /// Shortest time between two frames that the bus can carry, known after open().
  [[nodiscard]] virtual std::int64_t period_ns() const noexcept = 0;
  /// How long after the instant of the cycle a frame is best handed over, so that none is skipped or sent
  /// twice as the two threads drift; nothing: whenever.
  [[nodiscard]] virtual std::optional<std::int64_t> phase_ns() const noexcept { return std::nullopt; }
  /// After a stall the device catches up in steps as long as one after its period and, at most, this.
  [[nodiscard]] virtual std::int64_t longest_gap_ns() const noexcept { return 20'000'000; }
  /// Hands a frame over. `approach` asks for a slow motion to it, from wherever the servos are; only a device
  /// that interpolates is asked. False: it was kept back, since nothing says yet that the device is still the one that had
  /// the frames before it.
  virtual bool send(const ServoFrame& frame, bool approach) = 0;
  /// How long a slow approach takes; 0: the device does not interpolate, and ramps there in small steps.
  [[nodiscard]] virtual std::int64_t approach_ns() const noexcept { return 0; }
  /// Whether the servos' pulses are those of the last approach; asked while one is under way, so that its limits are not
  /// lifted before it has ended. Nothing: the device does not say, and its time decides.
  [[nodiscard]] virtual std::optional<bool> has_arrived() { return std::nullopt; }
  /// Ends the approach that is under way, where the servos are now. For a device that interpolates.
  virtual void halt() {}
  /// Reads the servos' positions; kNothing where the device has none. Also shows that it is alive, energised or
  /// not.
  virtual BusReading measure(const ServoFrame& frame) = 0;
  /// Where its servos are to be by what they were energised at, or were sent since, for a device that measures: under load
  /// they are a little off. Nothing: it does not tell.
  [[nodiscard]] virtual std::optional<BusReading> held() const { return std::nullopt; }
  /// Whether the device has replied since the last call; read after every frame. Only a device that replies
  /// is healthy; one that is queried less often than every frame reports false in between.
  [[nodiscard]] virtual bool has_answered() noexcept { return true; }
  /// Whether measure() gives the joints by encoders; then nothing is approached from a guess.
  [[nodiscard]] virtual bool has_encoders() const noexcept { return false; }
  /// Whether the device has an emergency stop input. One that has is heard, or counts as pressed: while it is lost, too.
  [[nodiscard]] virtual bool has_stop_input() const noexcept { return false; }
  /// Asks for it; read after every frame. A reply that is missing is no exception: it is unheard after a deadline that
  /// replies to other queries do not prolong.
  virtual StopInputLevel emergency_stop() { return StopInputLevel::kReleased; }
  /// What is wrong with it, though it goes on; read after every frame.
  [[nodiscard]] virtual std::optional<DeviceError> warning() { return std::nullopt; }
  /// The last thing sent: servos without pulses, where the profile says so.
  virtual void relax() = 0;
  /// A line for the operator's log, or empty; drained after every frame and after close().
  [[nodiscard]] virtual std::string drain_log() { return {}; }
};

}  // namespace corbot::rt
