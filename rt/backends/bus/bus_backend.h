// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "corbot/arm/arm_model.h"
#include "corbot/backend/backend.h"
#include "corbot/backend/emergency_stop.h"
#include "corbot/channel/snapshot_cell.h"
#include "rt/backends/bus/approach.h"
#include "rt/backends/bus/bus_device.h"
#include "rt/backends/bus/frame_sender.h"

namespace corbot::rt {

struct BusSettings {
  std::string name;            ///< `kind` in the profile
  bool readback{false};        ///< ask for positions and report them as measured
  bool relax_at_end{false};    ///< else the servos hold
  double reopen_after_s{0.2};  ///< the first time; doubled up to ten times as much
  int priority{0};             ///< SCHED_FIFO of the thread, where permitted; 0: an ordinary thread
};

/// A device on a bus that may block, served by a thread of its own. The cycle leaves its newest frame in a
/// cell and takes the newest feedback from another; neither waits for the bus. Frames in between are skipped,
/// never queued.
///
/// A question without an answer, or with a wrong one, makes the device degraded, as does what it warns of;
/// too many in a row, or any other failure, and it is lost: the thread closes it and tries again, more and
/// more rarely. When it is back, its first frame is approached slowly: by the device itself, or in small
/// steps from the position that it reports, or else from the last pulses that it was given. It is open
/// again only after that approach, so nothing is commanded meanwhile. A frame that is far from the last one,
/// because the bus has stalled, is reached at no more than twice the speed that the profile allows.
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
  void write(const ServoFrame& frame) noexcept override { newest_.store(frame); }
  [[nodiscard]] ServoFeedback read() noexcept override;
  [[nodiscard]] BackendHealth health() const noexcept override {
    return health_.load(std::memory_order_acquire);
  }
  [[nodiscard]] DeviceCause cause() const noexcept override { return cause_.load(std::memory_order_relaxed); }
  [[nodiscard]] BackendTimes times() const noexcept override { return sender_.times(); }
  [[nodiscard]] std::vector<LogLine> drain_log() override;
  [[nodiscard]] const char* name() const noexcept override { return settings_.name.c_str(); }

 private:
  void run() noexcept;
  /// Serves an open device until the end is asked for; throws DeviceError.
  void serve();
  void exchange();
  /// To the newest frame; false when the end was asked for meanwhile.
  bool approach();
  [[nodiscard]] double angle_rad(std::size_t joint, const BusReading& reading) const;
  void leave() noexcept;
  void tolerate(const DeviceError& error);
  void degrade(const DeviceError& error);
  /// When the frame after the one at `last` is due.
  [[nodiscard]] std::chrono::steady_clock::time_point next_due(
      std::chrono::steady_clock::time_point last) const;
  /// Sleeps; false when the end was asked for meanwhile.
  bool pause_until(std::chrono::steady_clock::time_point due);
  void log(std::string text, LogLine::Kind kind = LogLine::Kind::kInfo);

  const ArmModel arm_;
  const std::unique_ptr<BusDevice> device_;
  const BusSettings settings_;
  EmergencyStop& stop_;
  SnapshotCell<ServoFrame> newest_;
  FrameSender sender_;
  Approach approach_;
  bool is_connected_{false};  ///< by connect(), not yet served
  bool is_starting_{false};   ///< open() is under way
  std::chrono::steady_clock::time_point open_since_{};
  int misses_{0};  ///< in a row
  int good_{0};    ///< in a row

  SnapshotCell<ServoFeedback> feedback_;
  std::atomic<BackendHealth> health_{BackendHealth::kClosed};
  std::atomic<DeviceCause> cause_{DeviceCause::kNone};
  std::atomic<bool> is_cancelled_{false};

  std::mutex mutex_;  // of what follows; never taken by the cycle
  std::condition_variable wake_;
  bool end_{false};
  std::vector<LogLine> log_;
  std::thread thread_;
};

}  // namespace corbot::rt
