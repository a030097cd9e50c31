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

/// When the arm's position is to be written: at once when it has come to rest somewhere else or a hold or an Error has
/// begun or ended, and about every second while it moves. Pure.
class SavePolicy {
 public:
  using Instant = std::chrono::steady_clock::time_point;

  [[nodiscard]] bool is_due(const Snapshot& now, Instant at) const;
  void saved(const Snapshot& now, Instant at);
  /// It did not work: not again for a while.
  void failed(Instant at);

 private:
  std::optional<Snapshot> last_;
  Instant saved_at_{};
  Instant not_before_{};
};

/// Saves the last set-point on disk, in a thread of its own that polls ten times a second; no call waits for
/// it. A fault of the disk is reported once, until it has passed.
class PositionSaver {
 public:
  using Warn = std::function<void(const std::string&)>;

  /// `link` outlives this. `warn` is called from the thread.
  PositionSaver(const Link& link, const ArmModel& arm, PositionStore store, Warn warn);
  PositionSaver(const PositionSaver&) = delete;
  PositionSaver& operator=(const PositionSaver&) = delete;
  /// After a last poll.
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
