// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <condition_variable>
#include <functional>
#include <mutex>
#include <optional>
#include <string>
#include <thread>

#include "robot/link.h"
#include "state/position_store.h"

namespace corbot {

/// Decides when to save the arm's position. A save is due at once when the arm has come to rest at another
/// place. A save is also due when a hold or an Error has begun or ended, and about every second during
/// motion. Pure.
class SavePolicy {
 public:
  using Instant = std::chrono::steady_clock::time_point;

  [[nodiscard]] bool is_due(const Snapshot& now, Instant at) const;
  void saved(const Snapshot& now, Instant at);
  /// Records a failed save: the next attempt follows after a pause.
  void failed(Instant at);

 private:
  std::optional<Snapshot> last_;
  Instant saved_at_{};
  Instant not_before_{};
};

/// Saves the last set-point on disk in a thread of its own, which polls ten times a second. No call waits for
/// it. Reports a fault of the disk once, until the fault has passed.
class PositionSaver {
 public:
  using Warn = std::function<void(const std::string&)>;

  /// `link` outlives this. The thread calls `warn`.
  PositionSaver(const Link& link, const ArmModel& arm, PositionStore store, Warn warn);
  PositionSaver(const PositionSaver&) = delete;
  PositionSaver& operator=(const PositionSaver&) = delete;
  /// Polls a last time.
  ~PositionSaver();

 private:
  void run();
  void poll();

  const Link& link_;
  const ArmModel arm_;
  const PositionStore store_;
  const Warn warn_;
  SavePolicy rule_;
  bool has_warned_{false};
  std::mutex mutex_;
  std::condition_variable end_requested_;
  bool end_{false};
  std::thread thread_;
};

}  // namespace corbot
