// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "corbot/arm/arm_model.h"
#include "corbot/backend/backend.h"
#include "corbot/backend/emergency_stop.h"
#include "corbot/channel/snapshot_cell.h"
#include "rt/backends/bus/approach.h"
#include "rt/backends/bus/bus_device.h"
#include "rt/backends/bus/frame_rate.h"
#include "rt/backends/bus/frame_sender.h"
#include "rt/backends/bus/lasting_cell.h"
#include "rt/backends/bus/newest_frame.h"
#include "rt/backends/bus/standstill.h"
#include "rt/backends/bus/stop_state.h"

namespace corbot::rt {

struct BusSettings {
  std::string name;            ///< `kind` in the profile
  bool readback{false};        ///< report positions while the device is open; encoders always do
  bool relax_at_end{false};    ///< false: the servos hold
  double reopen_after_s{0.2};  ///< the first pause; doubled up to ten times as much
  int priority{0};             ///< SCHED_FIFO of the thread, if permitted; 0: an ordinary thread
  int stagger_ms{0};           ///< between the first pulses of two servos
  double ramp_s{1.0};          ///< longest time from a press to power off; 0 in stop category 0
};

/// A device on a bus that may block, served by a thread of its own. The cycle leaves its newest frame in a
/// cell and takes the newest feedback from another; neither waits for the bus. Frames in between are skipped,
/// never queued.
///
/// A query without a reply, or with a wrong one, makes the device degraded. So do its warnings, and fewer
/// frames than it announced. Too many failures in a row, or any other failure, and it is lost: the thread
/// closes it and tries again, at growing intervals.
///
/// Energy. A device that is back stands by: it is watched, and its feedback published. Nothing is energised
/// and nothing moves before a frame without needs_clear. Then the servos get their energy, and the first
/// frame is approached slowly. The device itself approaches, or the thread does in small steps from the
/// reported position, else from the last pulses. A device that measures is held at the targets at which it
/// was energised, and awaits the frames there. It is open again only after that approach. A stop on the way
/// takes the energy off again, if the device can do that.
/// At power_off, or when a ramp's time has passed since a press, a device that can de-energise its servos
/// does so, and stands by. A device that cannot stays open and holds. A start in Error begins with standing
/// by.
///
/// If the bus has stalled, a frame may be far from the last one. It is reached at no more than twice the
/// speed that the profile allows, in Error at hardly more than that speed. A thread that stood still for
/// longer while the cycle went on counts as a loss: it sends none of the later frames (standstill.h).
class BusBackend final : public Backend {
 public:
  /// `stop` gets the state of the device's emergency stop input; must outlive this.
  BusBackend(const ArmModel& arm, std::unique_ptr<BusDevice> device, BusSettings settings,
             EmergencyStop& stop);
  ~BusBackend() override { close(); }

  DevicePosition connect() override;
  void open(const ServoFrame& first) override;
  void cancel() noexcept override { is_cancelled_.store(true, std::memory_order_relaxed); }
  void close() noexcept override;
  void write(const ServoFrame& frame) noexcept override { frames_.store(frame); }
  [[nodiscard]] ServoFeedback read() noexcept override;
  [[nodiscard]] bool has_encoders() const noexcept override { return device_->has_encoders(); }
  [[nodiscard]] BackendHealth health() const noexcept override {
    return health_.load(std::memory_order_acquire);
  }
  [[nodiscard]] DeviceCause cause() const noexcept override { return cause_.load(std::memory_order_relaxed); }
  [[nodiscard]] BackendTimes times() const noexcept override { return sender_.times(); }
  [[nodiscard]] std::uint32_t beats() const noexcept override {
    return beats_.load(std::memory_order_relaxed);
  }
  [[nodiscard]] std::vector<LogLine> drain_log() override;
  [[nodiscard]] const char* name() const noexcept override { return settings_.name.c_str(); }

 private:
  /// The phases of the thread. Each lasts until the next, or throws DeviceError.
  enum class Phase { kReopen, kStandby, kApproach, kServe, kEnd };

  void run_from(Phase phase) noexcept;
  [[nodiscard]] Phase run(Phase phase);
  [[nodiscard]] Phase stand_by();
  [[nodiscard]] Phase approach();
  [[nodiscard]] Phase serve();
  /// Returns true if the device was open for long before.
  bool lose(const DeviceError& error);
  /// Finds the servos' positions before anything is sent. Throws if encoders report none.
  [[nodiscard]] BusReading find(const ServoFrame& frame);
  void give_up_start(bool is_proper_end) noexcept;
  void exchange();
  [[nodiscard]] bool is_read_back() const noexcept { return settings_.readback || has_encoders(); }
  /// Counts a frame that kept the device busy this long.
  void count_frame(std::chrono::steady_clock::duration busy);
  /// Tells whether energy and motion are forbidden now; reads the device's stop input.
  [[nodiscard]] bool is_stopped(const ServoFrame& newest);
  void publish(const BusReading& reading);
  /// Returns true if the device no longer gives the servos energy.
  [[nodiscard]] bool switch_off_where_due();
  void leave(bool is_proper_end) noexcept;
  void tolerate(const DeviceError& error);
  void degrade(const DeviceError& error);
  /// Returns the time of the frame after the one at `last`.
  [[nodiscard]] std::chrono::steady_clock::time_point next_due(
      std::chrono::steady_clock::time_point last) const;
  /// Sleeps; false if the end was requested meanwhile.
  bool pause_until(std::chrono::steady_clock::time_point due);
  /// Throws if cancel() has been called during open().
  void end_cancelled_start() const;
  void log(std::string text, LogLine::Kind kind = LogLine::Kind::kInfo);

  const ArmModel arm_;
  const std::unique_ptr<BusDevice> device_;
  const BusSettings settings_;
  EmergencyStop& stop_;
  SnapshotCell<ServoFrame> frames_;
  NewestFrame newest_;
  FrameSender sender_;
  FrameRate rate_;
  Standstill standstill_;
  StopState stop_state_;
  Approach approach_;
  bool is_energised_{false};
  bool is_power_off_done_{false};  ///< the device was ordered to, and cannot
  bool is_connected_{false};       ///< by connect(), not yet served
  BusReading found_{};             ///< by connect()
  bool is_starting_{false};        ///< open() is in progress
  std::chrono::steady_clock::time_point open_since_{};
  int misses_{0};  ///< in a row
  int good_{0};    ///< in a row

  LastingCell<ServoFeedback> feedback_;
  std::atomic<BackendHealth> health_{BackendHealth::kClosed};
  std::atomic<DeviceCause> cause_{DeviceCause::kNone};
  std::atomic<bool> is_cancelled_{false};
  std::atomic<std::uint32_t> beats_{0};

  std::mutex mutex_;  // guards the members below; the cycle never takes it
  std::condition_variable wake_;
  bool end_{false};
  std::vector<LogLine> log_;
  std::thread thread_;
};

}  // namespace corbot::rt
