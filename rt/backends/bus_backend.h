// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <condition_variable>
#include <memory>
#include <mutex>
#include <string>
#include <thread>

#include "corbot/arm/arm_model.h"
#include "corbot/backend/backend.h"
#include "corbot/channel/snapshot_cell.h"
#include "rt/backends/bus_device.h"

namespace corbot::rt {

struct BusSettings {
  std::string name;            ///< what `kind` in the profile says
  bool readback{false};        ///< ask for positions and report them as measured
  bool relax_at_end{false};    ///< else the servos hold
  double reopen_after_s{0.2};  ///< the first time; doubled up to ten times as much
};

/// A device on a bus that may block, served by a thread of its own. The cycle leaves its newest frame in a
/// cell and takes the newest feedback from another; neither waits for the bus. Frames in between are skipped,
/// never queued.
///
/// A device that fails is lost: the thread closes it and tries again, more and more rarely. When it is back,
/// its first frame is approached slowly, because nobody knows where the servos are by then; the device is
/// open again only after that approach, so nothing is commanded meanwhile.
class BusBackend final : public Backend {
 public:
  BusBackend(const ArmModel& arm, std::unique_ptr<BusDevice> device, BusSettings settings);
  ~BusBackend() override { close(); }

  void open(const ServoFrame& first) override;
  void close() noexcept override;
  void write(const ServoFrame& frame) noexcept override { newest_.store(frame); }
  [[nodiscard]] ServoFeedback read() noexcept override;
  [[nodiscard]] BackendHealth health() const noexcept override {
    return health_.load(std::memory_order_acquire);
  }
  [[nodiscard]] std::uint32_t cause() const noexcept override {
    return cause_.load(std::memory_order_relaxed);
  }
  [[nodiscard]] std::string take_news() override;
  [[nodiscard]] const char* name() const noexcept override { return settings_.name.c_str(); }

 private:
  void run() noexcept;
  /// Serves an open device until the end is asked for; throws DeviceError.
  void serve();
  void exchange(bool approach);
  /// Sleeps; false when the end was asked for meanwhile.
  bool pause(std::int64_t nanoseconds);
  void tell(const std::string& news);

  const ArmModel arm_;
  const std::unique_ptr<BusDevice> device_;
  const BusSettings settings_;

  SnapshotCell<ServoFrame> newest_;
  SnapshotCell<ServoFeedback> feedback_;
  std::atomic<BackendHealth> health_{BackendHealth::kClosed};
  std::atomic<std::uint32_t> cause_{0};

  std::mutex mutex_;  // of what follows; never taken by the cycle
  std::condition_variable wake_;
  bool end_{false};
  std::string news_;
  std::thread thread_;
};

}  // namespace corbot::rt
