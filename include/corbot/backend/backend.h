// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "corbot/backend/device_cause.h"
#include "corbot/backend/log_line.h"
#include "corbot/kinematics/joints.h"

namespace corbot {

/// What a backend is handed every cycle. It takes the pulses, or the joint set-points,
/// whichever its device speaks.
struct ServoFrame {
  std::uint64_t cycle{};
  std::int64_t time_ns{};  ///< CLOCK_MONOTONIC, the instant the cycle was due
  std::uint32_t servo_count{};
  /// The robot is in Error and waits for Clear: what has no energy gets none, and a device that moves on its own stops.
  /// What has energy follows the set-points, which come to rest.
  bool needs_clear{};
  /// The servos' energy is to be taken off, where the device can do that; only ever together with needs_clear.
  bool power_off{};
  std::array<double, kMaxServos> pulse_us{};  ///< bounded by the servo map
  std::array<std::uint32_t, kMaxServos> channel{};
  Joints position_q{};
};

/// What a device says of the joints; position_q is valid where `measured` or `commanded`.
struct ServoFeedback {
  bool measured{false};    ///< by encoders
  bool commanded{false};   ///< the pulses that it sends, which say nothing about the shafts
  std::int64_t time_ns{};  ///< CLOCK_MONOTONIC, when it was said
  Joints position_q{};
  double opening{-1.0};  ///< of the gripper, 0 … 1; negative: not reported
};

/// The servo positions that a device reports before anything has been sent to it.
struct DevicePosition {
  enum class Kind {
    kUnknown,    ///< none reported, or it has been without power
    kCommanded,  ///< the pulses that it is sending, rounded
    kMeasured,   ///< by encoders
  };
  Kind kind{Kind::kUnknown};
  Joints position_q{};
  double opening{};  ///< of the gripper, 0 … 1; negative: not reported
};

/// How far a device is behind the cycle.
struct BackendTimes {
  std::uint64_t frames{};     ///< that the device has taken
  std::int64_t age_ns{};      ///< of the last frame when the device had taken it
  std::int64_t age_max_ns{};  ///< the longest since the device was opened
  std::uint64_t cycle{};      ///< ServoFrame::cycle of the newest frame that the device has taken
  /// The share of its planned speed at which the arm's path still arrives at the device as it was announced: below 1
  /// where the device takes fewer frames than it should.
  double speed_ratio{1.0};
};

enum class BackendHealth : std::uint32_t {
  kClosed,
  kOpen,
  kDegraded,
  kLost,
  /// There and watched, and the servos get no energy from it: until a frame without needs_clear, after which they are
  /// energised and brought slowly to where the arm is held, and it is open. Its feedback says where they are.
  kStandby,
};

/// The one face of everything that moves servos. `write`, `read` and `health` are called from the real-time
/// cycle and must be real-time safe: bounded, no allocation, no lock, no blocking call, no system call. A
/// device on a blocking bus is served by a thread of the backend's own, through a latest-value hand-over.
class Backend {
 public:
  Backend() = default;
  Backend(const Backend&) = delete;
  Backend& operator=(const Backend&) = delete;
  virtual ~Backend() = default;

  /// Not real-time safe. Opens the device, moves nothing, and asks where the servos are. Throws as open()
  /// does, which does it where it has not been done.
  virtual DevicePosition connect() { return {}; }
  /// Not real-time safe. Opens the device, and brings the servos to `first`, the assumed position of the arm;
  /// throws std::runtime_error naming the device and the cause. An emergency stop meanwhile ends it.
  virtual void open(const ServoFrame& first) = 0;
  /// For a signal handler. An open() that is under way ends soon, with an exception and the servos held.
  virtual void cancel() noexcept {}
  /// Not real-time safe. Ends threads, closes the device. May be called twice.
  virtual void close() noexcept = 0;

  /// Real-time safe. The newest frame wins.
  virtual void write(const ServoFrame& frame) noexcept = 0;
  /// Real-time safe.
  [[nodiscard]] virtual ServoFeedback read() noexcept = 0;
  /// Real-time safe. Whether the device measures the joints: where read() does not say so, it is not known where they
  /// are. Does not change.
  [[nodiscard]] virtual bool has_encoders() const noexcept { return false; }
  /// Real-time safe.
  [[nodiscard]] virtual BackendHealth health() const noexcept = 0;
  /// Real-time safe. Why it is degraded or lost.
  [[nodiscard]] virtual DeviceCause cause() const noexcept { return DeviceCause::kNone; }
  /// Real-time safe.
  [[nodiscard]] virtual BackendTimes times() const noexcept { return {}; }
  /// Real-time safe. How often the thread that serves the device has come round, also while it waits or tries again;
  /// 0: it has none. For a watchdog: any thread may ask.
  [[nodiscard]] virtual std::uint32_t beats() const noexcept { return 0; }
  /// Not real-time safe. What has happened since the last call.
  [[nodiscard]] virtual std::vector<LogLine> drain_log() { return {}; }
  /// Not real-time safe, once the device is open. Lets an operator provoke faults by signals to the process;
  /// only a simulated device has such controls.
  virtual void install_fault_controls() {}
  /// Static text, ASCII: `kind` of [backend] in a profile.
  [[nodiscard]] virtual const char* name() const noexcept = 0;
};

}  // namespace corbot
