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
#include "rt/backends/bus/approach_speed.h"
#include "rt/backends/loopback/plug_signals.h"
#include "sim/servo_model.h"

namespace corbot::rt {

struct LoopbackSettings {
  double frame_hz{50.0};  ///< rate at which pulses reach the servos
  sim::ServoModelOptions servo{};
  bool readback{false};  ///< report the servos' positions, as encoders would
};

/// One frame as the servos got it.
struct RecordedFrame {
  std::uint64_t cycle{};
  std::int64_t time_ns{};
  std::array<double, kMaxServos> pulse_us{};
  std::array<double, kMaxServos> servo_us{};  ///< positions of the shafts at that instant
};

/// Simulated servos, and the default backend. The frames have a rate of their own, decoupled from the loop's.
/// At the first write() of each frame period, by the time stamps, the servos take the newest pulses. The time
/// since the last frame passes then. No thread, no clock; write(), read() and health() are real-time safe.
/// Like a controller that sends pulses it has no energy to take off: at power_off the servos hold.
class LoopbackBackend final : public Backend, private Pluggable {
 public:
  static constexpr std::size_t kRecordedFrames = 512;

  LoopbackBackend(const ArmModel& arm, const LoopbackSettings& settings);

  void open(const ServoFrame& first) override;
  void close() noexcept override;
  void write(const ServoFrame& frame) noexcept override;
  [[nodiscard]] ServoFeedback read() noexcept override;
  [[nodiscard]] bool has_encoders() const noexcept override { return settings_.readback; }
  [[nodiscard]] BackendHealth health() const noexcept override {
    return health_.load(std::memory_order_relaxed);
  }
  [[nodiscard]] BackendTimes times() const noexcept override {
    return {.frames = frame_count_, .cycle = newest_cycle_};
  }
  [[nodiscard]] const char* name() const noexcept override { return "loopback"; }
  /// SIGUSR1 pulls the simulated plug, SIGUSR2 puts it back; until close().
  void install_fault_controls() override { signals_.emplace(static_cast<Pluggable&>(*this)); }

  /// Pulls the simulated plug, or puts it back; from any thread, also from a signal handler. Like a real
  /// device, it then stands by until a frame without needs_clear. The servos ramp slowly to the cycle's
  /// position of the arm, and only then is it open.
  void set_plugged(bool plugged) noexcept override;
  /// For tests: makes the device report a problem.
  void set_degraded() noexcept { health_.store(BackendHealth::kDegraded, std::memory_order_relaxed); }
  /// For tests, in the cycle's thread: returns the number of frames taken; the last kRecordedFrames are kept.
  [[nodiscard]] std::uint64_t frame_count() const noexcept { return frame_count_; }
  [[nodiscard]] const RecordedFrame& recorded(std::uint64_t index) const noexcept {
    return recorded_[index % kRecordedFrames];
  }

 private:
  /// Advances the health towards open, by the frame; returns the new health.
  BackendHealth follow(const ServoFrame& frame) noexcept;
  /// Changes the health, unless the plug was pulled meanwhile.
  bool change(BackendHealth from, BackendHealth to) noexcept {
    return health_.compare_exchange_strong(from, to, std::memory_order_acq_rel);
  }
  void take_frame(const ServoFrame& frame, double dt_s) noexcept;
  /// Tells whether the servos rest at its pulses.
  [[nodiscard]] bool is_at(const ServoFrame& frame) const noexcept;
  /// Replaces `frame` by the next step towards it, or to rest if it needs a Clear; true when it is reached.
  bool approach(ServoFrame& frame) noexcept;

  const ArmModel arm_;
  const LoopbackSettings settings_;
  const std::int64_t frame_period_ns_;
  std::array<sim::ServoModel, kMaxServos> servos_{};
  std::vector<RecordedFrame> recorded_;
  std::uint64_t frame_count_{0};
  std::int64_t next_frame_ns_{0};
  std::int64_t last_frame_ns_{0};
  std::uint64_t newest_cycle_{0};                 ///< of the last write() while open
  std::array<ApproachRamp, kMaxServos> ramps_{};  ///< of the approach
  std::array<double, kMaxServos> last_us_{};      ///< pulses that the servos got last
  std::atomic<bool> is_back_{false};              ///< plugged in again, still lost
  std::atomic<BackendHealth> health_{BackendHealth::kClosed};
  std::optional<PlugSignals> signals_;
};

}  // namespace corbot::rt
