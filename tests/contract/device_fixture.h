// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <functional>
#include <iosfwd>
#include <memory>
#include <string>
#include <vector>

#include "config/profile.h"
#include "corbot/arm/arm_model.h"
#include "corbot/backend/backend.h"
#include "corbot/backend/emergency_stop.h"
#include "support/paths.h"

namespace corbot::test {

/// A device's output at one servo from some instant on (joints first, then the gripper): pulses in us, or
/// radians of a drive.
struct Output {
  std::int64_t time_ns;  ///< CLOCK_MONOTONIC; 0 where the device has no clock
  std::size_t servo;
  double value;
};

/// The properties of a kind of device that the suite needs.
struct DeviceFacts {
  bool takes_joints{false};  ///< else pulses
  double unit{};             ///< resolution of what it puts out, us or rad
  double noise{
      0.0};  ///< by which an output differs from one frame to the next though it is given the same, us
  double period_s{};            ///< between two frames that it takes, as its manual and its line allow
  double approach_speed{};      ///< at most, of an output on the way back from a loss, us/s or rad/s
  double read_unit{0.0};        ///< resolution of what it reads back, us or rad; 0: it does not
  bool has_encoders{false};     ///< what it reads back is measured
  bool takes_power_off{false};  ///< it can take the energy off its servos
  double skew_s{0.0};  ///< from the first servo of a frame to the last, where they do not start together
  bool goes_off_unplugged{true};      ///< an unplugged one is switched on again, its outputs off
  bool pluggable{true};               ///< whether its plug can be pulled here
  bool ends_with_its_program{false};  ///< no pulses without the process that makes them
  std::string at_end{};               ///< "hold", "relax", or empty: the device has no such choice
};

/// A place for one device, real or emulated: the backend is found in `backend_section`, and what the device
/// does can be seen from outside the backend.
class DeviceFixture {
 public:
  DeviceFixture() = default;
  DeviceFixture(const DeviceFixture&) = delete;
  DeviceFixture& operator=(const DeviceFixture&) = delete;
  virtual ~DeviceFixture() = default;

  /// Empty, or why this device cannot be had here.
  [[nodiscard]] virtual std::string missing() const { return {}; }
  virtual void set_up() = 0;
  /// [backend] of a profile, as TOML.
  [[nodiscard]] virtual std::string backend_section() const = 0;
  [[nodiscard]] virtual DeviceFacts facts() const = 0;
  /// The backend of a profile; a fixture may put an emulated device under it.
  [[nodiscard]] virtual std::unique_ptr<Backend> make(const Profile& profile, EmergencyStop& stop);

  virtual void unplug() = 0;
  virtual void plug() = 0;
  /// Every change that was seen so far, in the order of time.
  virtual std::vector<Output> outputs() = 0;
  /// Returns the present output, a value a servo; NaN: nothing.
  virtual std::vector<double> now() = 0;

  /// Whether the servos have energy from it; where the device cannot take that off, whether it sends
  /// anything.
  virtual bool is_energised() {
    const std::vector<double> found = now();
    return std::any_of(found.begin(), found.end(), [](double value) { return !std::isnan(value); });
  }

  /// For devices inside the backend.
  virtual void attach(Backend&) {}
  /// After each write(), in the thread that wrote; real-time safe.
  virtual void after_write() noexcept {}
};

/// A fixture by name; the name is that of the test.
struct DeviceFixtureKind {
  std::string name;
  std::function<std::unique_ptr<DeviceFixture>(const ArmModel& arm, const std::string& directory)> make;
  std::string profile{CORBOT_TIMED_PROFILE};  ///< of the arm, but for [backend]
};
void PrintTo(const DeviceFixtureKind& kind, std::ostream* out);

std::vector<DeviceFixtureKind> loopback_fixtures();
std::vector<DeviceFixtureKind> serial_fixtures();
/// On an arm whose joints slide.
std::vector<DeviceFixtureKind> sliding_fixtures();
std::vector<DeviceFixtureKind> pulse_fixtures();
std::vector<DeviceFixtureKind> can_fixtures();
std::vector<DeviceFixtureKind> kernel_fixtures();
/// All whose devices are outside the process that drives them.
std::vector<DeviceFixtureKind> outside_fixtures();
std::vector<DeviceFixtureKind> all_fixtures();

}  // namespace corbot::test
