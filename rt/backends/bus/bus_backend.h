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
  bool relax_at_end{false};    ///< else the servos hold
  double reopen_after_s{0.2};  ///< the first time; doubled up to ten times as much
  int priority{0};             ///< SCHED_FIFO of the thread, where permitted; 0: an ordinary thread
  int stagger_ms{0};           ///< between the first pulses of two servos
  double ramp_s{1.0};          ///< from a press to power off, at most; 0 in stop category 0
};

/// A device on a bus that may block, served by a thread of its own. The cycle leaves its newest frame in a
/// cell and takes the newest feedback from another; neither waits for the bus. Frames in between are skipped,
/// never queued.
///
/// A question without an answer, or with a wrong one, makes the device degraded, as do what it warns of and
/// fewer frames than it announced; too many in a row, or any other failure, and it is lost: the thread closes it
/// and tries again, more and more rarely.
///
/// Energy. A device that is back stands by: it is watched, and its feedback published, but nothing is energised
/// and nothing moves before a frame without needs_clear. Then its servos get their energy, and its first frame is
/// approached slowly: by the device itself, or in small steps from the position that it reports, or else from
/// the last pulses that it was given. A device that measures is held at the targets at which it got its energy, and the
/// frames are awaited there. It is open again only after that approach; a stop on the way takes the energy off
/// again, where the device can do that. At power_off, or when a press is so old as a ramp may take, a device that can take
/// the energy off its servos does so, and stands by; one that cannot stays open and holds. A start in Error begins with
/// standing by.
///
/// A frame that is far from the last one, because the bus has stalled, is reached at no more than twice the speed
/// that the profile allows, in Error at hardly more than that speed. A thread that has stood still for longer while the cycle
/// went on is a loss: it sends nothing of what came after (standstill.h).
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
  /// What the thread does; each lasts until the next, or throws DeviceError.
  enum class Phase { kReopen, kStandby, kApproach, kServe, kEnd };

  void run_from(Phase phase) noexcept;
  [[nodiscard]] Phase run(Phase phase);
  [[nodiscard]] Phase stand_by();
  [[nodiscard]] Phase approach();
  [[nodiscard]] Phase serve();
  /// True when it was open for long before.
  bool lose(const DeviceError& error);
  /// Where the servos are before anything is sent. Throws where encoders do not say so.
  [[nodiscard]] BusReading find(const ServoFrame& frame);
  void give_up_start(bool is_proper_end) noexcept;
  void exchange();
  [[nodiscard]] bool is_read_back() const noexcept { return settings_.readback || has_encoders(); }
  /// A frame has kept the device busy so long.
  void count_frame(std::chrono::steady_clock::duration busy);
  /// Whether nothing may be energised or moved now; reads the device's stop input.
  [[nodiscard]] bool is_stopped(const ServoFrame& newest);
  void publish(const BusReading& reading);
  /// True when the servos have no energy from the device any more.
  [[nodiscard]] bool switch_off_where_due();
  void leave(bool is_proper_end) noexcept;
  void tolerate(const DeviceError& error);
  void degrade(const DeviceError& error);
  /// When the frame after the one at `last` is due.
  [[nodiscard]] std::chrono::steady_clock::time_point next_due(
      std::chrono::steady_clock::time_point last) const;
  /// Sleeps; false when the end was asked for meanwhile.
  bool pause_until(std::chrono::steady_clock::time_point due);
  /// Throws where cancel() has been called during open().
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
  bool is_power_off_done_{false};  ///< the device was asked to, and cannot
  bool is_connected_{false};       ///< by connect(), not yet served
  BusReading found_{};             ///< by connect()
  bool is_starting_{false};        ///< open() is under way
  std::chrono::steady_clock::time_point open_since_{};
  int misses_{0};  ///< in a row
  int good_{0};    ///< in a row

  LastingCell<ServoFeedback> feedback_;
  std::atomic<BackendHealth> health_{BackendHealth::kClosed};
  std::atomic<DeviceCause> cause_{DeviceCause::kNone};
  std::atomic<bool> is_cancelled_{false};
  std::atomic<std::uint32_t> beats_{0};

  std::mutex mutex_;  // of what follows; never taken by the cycle
  std::condition_variable wake_;
  bool end_{false};
  std::vector<LogLine> log_;
  std::thread thread_;
};

}  // namespace corbot::rt
