// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "corbot/backend/device_cause.h"
#include "corbot/backend/log_line.h"
#include "corbot/kinematics/joints.h"

namespace corbot {

/// The input of a backend in every cycle. A backend takes the pulses or the joint set-points, as its device
/// needs.
struct ServoFrame {
  std::uint64_t cycle{};
  std::int64_t time_ns{};  ///< CLOCK_MONOTONIC, the instant the cycle was due
  std::uint32_t servo_count{};
  /// The robot is in Error and waits for Clear. Servos without energy get none, and a device that moves on
  /// its own stops. Servos with energy follow the set-points, which come to rest.
  bool needs_clear{};
  /// The servos must be de-energised, if the device can do that. It is only ever set together with
  /// needs_clear.
  bool power_off{};
  std::array<double, kMaxServos> pulse_us{};  ///< bounded by the servo map
  std::array<std::uint32_t, kMaxServos> channel{};
  Joints position_q{};
};

/// The joints as a device reports them; position_q is valid if `measured` or `commanded`.
struct ServoFeedback {
  bool measured{false};    ///< by encoders
  bool commanded{false};   ///< from the pulses that the device sends, which say nothing about the shafts
  std::int64_t time_ns{};  ///< CLOCK_MONOTONIC of the report
  Joints position_q{};
  double opening{-1.0};  ///< opening of the gripper, 0 … 1; negative: not reported
};

/// The servo positions that a device reports before anything has been sent to it.
struct DevicePosition {
  enum class Kind {
    kUnknown,    ///< none reported, or the device has been without power
    kCommanded,  ///< the pulses that the device sends, rounded
    kMeasured,   ///< by encoders
  };
  Kind kind{Kind::kUnknown};
  Joints position_q{};
  double opening{};  ///< opening of the gripper, 0 … 1; negative: not reported
};

/// The delay of a device behind the cycle.
struct BackendTimes {
  std::uint64_t frames{};     ///< number of frames that the device has taken
  std::int64_t age_ns{};      ///< age of the last frame when the device had taken it
  std::int64_t age_max_ns{};  ///< the greatest age since the device was opened
  std::uint64_t cycle{};      ///< ServoFrame::cycle of the newest frame that the device has taken
  /// The share of its planned speed at which the arm's path arrives at the device as announced. It is below 1
  /// if the device takes fewer frames than it should.
  double speed_ratio{1.0};
};

enum class BackendHealth : std::uint32_t {
  kClosed,
  kOpen,
  kDegraded,
  kLost,
  /// The device is present and watched, and gives the servos no energy until a frame without needs_clear.
  /// Then it energises the servos and moves them slowly to the arm's held position, and becomes open. Its
  /// feedback reports their positions.
  kStandby,
};

/// The only interface of everything that moves servos. The real-time cycle calls `write`, `read` and
/// `health`. They must be real-time safe: bounded, no allocation, no lock, no blocking call, no system call.
/// A device on a blocking bus has a thread of the backend's own, and exchanges latest values with it.
class Backend {
 public:
  Backend() = default;
  Backend(const Backend&) = delete;
  Backend& operator=(const Backend&) = delete;
  virtual ~Backend() = default;

  /// Not real-time safe. Opens the device, moves nothing, and reads the positions of the servos. Throws as
  /// open() does. open() calls it if it has not been called.
  virtual DevicePosition connect() { return {}; }
  /// Not real-time safe. Opens the device, and brings the servos to `first`, the assumed position of the arm.
  /// Throws std::runtime_error naming the device and the cause. An emergency stop meanwhile ends it.
  virtual void open(const ServoFrame& first) = 0;
  /// Safe in a signal handler. An open() in progress ends soon, with an exception and the servos held.
  virtual void cancel() noexcept {}
  /// Not real-time safe. Ends threads, closes the device. May be called twice.
  virtual void close() noexcept = 0;

  /// Real-time safe. The newest frame wins.
  virtual void write(const ServoFrame& frame) noexcept = 0;
  /// Real-time safe.
  [[nodiscard]] virtual ServoFeedback read() noexcept = 0;
  /// Real-time safe. Tells whether the device measures the joints. If so, and read() reports no measurement,
  /// the positions are unknown. Does not change.
  [[nodiscard]] virtual bool has_encoders() const noexcept { return false; }
  /// Real-time safe.
  [[nodiscard]] virtual BackendHealth health() const noexcept = 0;
  /// Real-time safe. Returns why the device is degraded or lost.
  [[nodiscard]] virtual DeviceCause cause() const noexcept { return DeviceCause::kNone; }
  /// Real-time safe.
  [[nodiscard]] virtual BackendTimes times() const noexcept { return {}; }
  /// Real-time safe. Counts the passes of the thread that serves the device, also while it waits or tries
  /// again; 0: there is no thread. It serves a watchdog, and any thread may call it.
  [[nodiscard]] virtual std::uint32_t beats() const noexcept { return 0; }
  /// Not real-time safe. Returns the log lines since the last call.
  [[nodiscard]] virtual std::vector<LogLine> drain_log() { return {}; }
  /// Not real-time safe; called when the device is open. Lets an operator provoke faults by signals to the
  /// process. Only a simulated device has such controls.
  virtual void install_fault_controls() {}
  /// Static text, ASCII: `kind` of [backend] in a profile.
  [[nodiscard]] virtual const char* name() const noexcept = 0;
};

}  // namespace corbot
