// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <condition_variable>
#include <cstdint>
#include <memory>
#include <mutex>
#include <string>
#include <thread>

#include "robot/published.h"
#include "shm/channel_client.h"

namespace corbot {

/// Receives the link's reports. The link's own thread calls these functions, one at a time.
class LinkListener {
 public:
  virtual ~LinkListener() = default;
  virtual void on_completion(const Completion& completion) = 0;
  virtual void on_alarm(const AlarmEvent& alarm) = 0;
  /// The real-time task died, ended, or was restarted. Running and queued commands will get no verdict.
  virtual void on_lost(const std::string& reason) = 0;
  /// A real-time task is connected and its cycle runs. `again`: not for the first time.
  virtual void on_attached(bool again) = 0;
  /// Every report that the connected task issued before this snapshot has been read.
  virtual void on_drained(const Snapshot& before) = 0;
  /// Called once, before the task first works for this servant. Numbers, pause and override have been taken
  /// over already.
  virtual void on_inherit(const Inheritance& inheritance) = 0;
};

/// The servant's end of the channel. Connects to the real-time task, retries while there is none, and detects
/// its death and its restart. A thread of its own drains completions and alarms.
class Link {
 public:
  Link(std::string name, std::uint64_t fingerprint, LinkListener& listener);
  Link(const Link&) = delete;
  Link& operator=(const Link&) = delete;
  ~Link() { close(); }

  /// Makes the first attempt and starts the thread. If a task runs, waits up to a second until it works for
  /// this servant. Throws SegmentError if another servant is connected or the name is invalid. Keeps any
  /// other fault as the cause and retries.
  void start();
  /// Ends the thread and the connection.
  void close();

  /// Returns true if a real-time task is connected and its cycle runs.
  [[nodiscard]] bool alive() const noexcept { return incarnation() != 0; }
  /// Returns true if a task has connected since the start: the previous servant's state is then taken over.
  [[nodiscard]] bool has_been_attached() const noexcept { return has_been_attached_; }
  /// Returns the incarnation of that task, or 0 if there is none.
  [[nodiscard]] std::uint64_t incarnation() const noexcept {
    return incarnation_.load(std::memory_order_acquire);
  }
  /// Returns the channel of the present task or of the last one; null if there was none. The channel stays
  /// mapped while the caller holds the pointer.
  [[nodiscard]] std::shared_ptr<ServantChannel> channel() const;
  /// Returns the number of the last stop that this servant knows of, or 0 before the first task. Takes no
  /// lock.
  [[nodiscard]] std::uint64_t stops() const noexcept;
  /// Counts a Stop and returns its number. Takes no lock, no memory and no system call.
  [[nodiscard]] std::uint64_t request_stop() noexcept;
  /// Reads the newest snapshot. Returns false if there has never been one.
  [[nodiscard]] bool snapshot(Snapshot& out) const;
  /// Waits until the listener has received every alarm that the task has issued, and the alarm of the task's
  /// loss. A client that has seen Error then finds its cause. The wait is bounded. The link's own thread must
  /// not call this.
  void await_alarms() const;
  /// Returns why alive() is false, and what to do about it.
  [[nodiscard]] std::string cause() const;
  /// Returns this servant's segment, which exists before any task and as long as this object.
  [[nodiscard]] ServantSegment& own() const noexcept { return port_.own(); }

 private:
  /// The servant's ends of the channel's rings, created anew for each connection.
  struct ReportRings;

  void run();
  [[nodiscard]] bool ending() const;
  /// Makes one attempt; keeps the cause of a failure.
  [[nodiscard]] std::shared_ptr<ServantChannel> try_connect(bool first);
  void set_cause(const std::string& cause);
  /// Waits until the task's cycle works for this servant. Returns false if the task ends before.
  [[nodiscard]] bool await_service(const ServantChannel& channel);
  void serve_until_gone(const ServantChannel& channel);
  void drain(const ServantChannel& channel, ReportRings& rings);
  void lose(const std::string& reason);

  const std::string name_;
  LinkListener& listener_;
  ServantPort port_;

  mutable std::mutex mutex_;  // guards the members below, held briefly
  std::condition_variable end_requested_;
  std::condition_variable connected_;
  std::shared_ptr<ServantChannel> channel_;
  std::string cause_;
  bool end_{false};

  mutable std::mutex alarms_mutex_;  // guards the two members below
  mutable std::condition_variable alarms_reported_;
  std::uint64_t alarms_seen_{0};  // number of alarms of the connected task that the listener has received
  bool is_losing_{false};         // the listener has not yet received the loss of the task

  Published<ServantChannel> published_;        // the pointer in channel_, for readers without a lock
  std::atomic<std::uint64_t> incarnation_{0};  // incarnation of the living task; 0: none
  std::atomic<bool> has_been_attached_{false};
  std::thread thread_;
};

}  // namespace corbot
