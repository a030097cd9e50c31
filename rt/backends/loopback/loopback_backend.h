// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "corbot/arm/arm_model.h"
#include "corbot/backend/backend.h"
#include "rt/backends/loopback/plug_signals.h"
#include "sim/servo_model.h"

namespace corbot::rt {

struct LoopbackSettings {
  double frame_hz{50.0};  ///< pulses reach the servos this often
  sim::ServoModelOptions servo{};
  bool readback{false};  ///< report the servos' positions as measured ones
};

/// One frame as the servos got it.
struct RecordedFrame {
  std::uint64_t cycle{};
  std::int64_t time_ns{};
  std::array<double, kMaxServos> pulse_us{};
  std::array<double, kMaxServos> servo_us{};  ///< where the shafts are at that instant
};

/// Simulated servos, and the default backend. The frames have a rate of their own, decoupled from the loop's:
/// at the first write() of each frame period, by the time stamps, the servos take the newest pulses and the
/// time since the last frame passes. No thread, no clock; write(), read() and health() are real-time safe.
class LoopbackBackend final : public Backend, private Pluggable {
 public:
  static constexpr std::size_t kRecordedFrames = 512;

  LoopbackBackend(const ArmModel& arm, const LoopbackSettings& settings);

  void open(const ServoFrame& first) override;
  void close() noexcept override;
  void write(const ServoFrame& frame) noexcept override;
  [[nodiscard]] ServoFeedback read() noexcept override;
  [[nodiscard]] BackendHealth health() const noexcept override {
    return health_.load(std::memory_order_relaxed);
  }
  [[nodiscard]] BackendTimes times() const noexcept override { return {frame_count_, 0, 0}; }
  [[nodiscard]] const char* name() const noexcept override { return "loopback"; }
  /// SIGUSR1 pulls the simulated plug, SIGUSR2 puts it back; until close().
  void install_fault_controls() override { signals_.emplace(static_cast<Pluggable&>(*this)); }

  /// From any thread, also from a signal handler: pulls the simulated plug, or puts it back. As with a real
  /// device, the servos then ramp slowly to where the cycle holds the arm, and it is open only after that.
  void set_plugged(bool plugged) noexcept override;
  /// For tests: a device that reports a problem.
  void set_degraded() noexcept { health_.store(BackendHealth::kDegraded, std::memory_order_relaxed); }
  /// For tests, in the cycle's thread: frames taken so far, of which the last kRecordedFrames are kept.
  [[nodiscard]] std::uint64_t frame_count() const noexcept { return frame_count_; }
  [[nodiscard]] const RecordedFrame& recorded(std::uint64_t index) const noexcept {
    return recorded_[index % kRecordedFrames];
  }

 private:
  void take_frame(const ServoFrame& frame, double dt_s) noexcept;
  /// A step from the last pulses towards those of `frame`; true when they are reached.
  bool ramp_to(ServoFrame& frame, double dt_s) const noexcept;

  const ArmModel arm_;
  const LoopbackSettings settings_;
  const std::int64_t frame_period_ns_;
  std::array<sim::ServoModel, kMaxServos> servos_{};
  std::vector<RecordedFrame> recorded_;
  std::uint64_t frame_count_{0};
  std::int64_t next_frame_ns_{0};
  std::int64_t last_frame_ns_{0};
  std::array<double, kMaxServos> last_us_{};  ///< that the servos were given
  std::atomic<bool> is_back_{false};          ///< plugged in again, not yet at the newest frame
  std::atomic<BackendHealth> health_{BackendHealth::kClosed};
  std::optional<PlugSignals> signals_;
};

}  // namespace corbot::rt
