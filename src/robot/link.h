// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <condition_variable>
#include <cstdint>
#include <memory>
#include <mutex>
#include <string>
#include <thread>

#include "shm/segment.h"

namespace corbot {

/// What the link reports to the robot; called from the link's own thread, one at a time.
class LinkListener {
 public:
  virtual ~LinkListener() = default;
  virtual void on_completion(const Completion& completion) = 0;
  virtual void on_alarm(const AlarmEvent& alarm) = 0;
  /// The real-time task died, ended, or was restarted:
  /// no command that was running or queued will get its verdict.
  virtual void on_lost(const std::string& reason) = 0;
  /// A real-time task is connected and its cycle runs. `again`: not the first time.
  virtual void on_attached(bool again) = 0;
  /// Every report that was out before this snapshot of the connected task has been read.
  virtual void on_drained(const Snapshot& before) = 0;
};

/// The servant's end of the channel: attaches to the segment, goes on trying while there is none, notices the
/// death and the restart of the real-time task, and drains completions and alarms in a thread of its own.
class Link {
 public:
  Link(std::string name, std::uint64_t fingerprint, LinkListener& listener);
  Link(const Link&) = delete;
  Link& operator=(const Link&) = delete;
  ~Link() { close(); }

  /// First attempt, then starts the thread. Throws SegmentError when another servant is attached; any other
  /// fault of the segment is kept as the cause and tried again.
  void start();
  /// Ends the thread and detaches.
  void close();

  /// A real-time task is connected and its cycle runs.
  [[nodiscard]] bool alive() const noexcept { return incarnation() != 0; }
  /// Of that task; 0 where there is none.
  [[nodiscard]] std::uint64_t incarnation() const noexcept {
    return incarnation_.load(std::memory_order_acquire);
  }
  /// The segment, dead or alive; null when there has been none. Stays mapped while the caller holds it.
  [[nodiscard]] std::shared_ptr<Segment> segment() const;
  /// The newest snapshot; false when there has never been one.
  [[nodiscard]] bool snapshot(Snapshot& out) const;
  /// Why alive() is false, and what to do about it.
  [[nodiscard]] std::string cause() const;

 private:
  /// The servant's ends of a segment's rings; the thread makes them anew for each connection.
  struct ReportRings;

  void run();
  /// One attempt; the cause is kept on failure.
  bool try_attach(bool first);
  void set_cause(const std::string& cause);
  void serve_until_gone(Segment& segment, ReportRings& rings);
  void drain(Segment& segment, ReportRings& rings);
  void lose(const std::string& reason);

  const std::string name_;
  const std::uint64_t fingerprint_;
  LinkListener& listener_;

  mutable std::mutex mutex_;  // of the members below, held for a moment only
  std::condition_variable end_requested_;
  std::shared_ptr<Segment> segment_;
  std::string cause_;
  bool end_{false};

  std::atomic<std::uint64_t> incarnation_{0};  // of the task that is alive; 0: none
  bool has_been_attached_{false};
  std::thread thread_;
};

}  // namespace corbot
