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
  /// Once, before the task works for this servant for the first time. Numbers, pause and override have been
  /// taken over.
  virtual void on_inherit(const Inheritance& inheritance) = 0;
};

/// The servant's end of the channel: connects to the real-time task, goes on trying while there is none, notices
/// its death and its restart, and drains completions and alarms in a thread of its own.
class Link {
 public:
  Link(std::string name, std::uint64_t fingerprint, LinkListener& listener);
  Link(const Link&) = delete;
  Link& operator=(const Link&) = delete;
  ~Link() { close(); }

  /// First attempt, then starts the thread; waits for a task that is there to work for this servant, a second at
  /// most. Throws SegmentError when another servant is connected; any other
  /// fault is kept as the cause and tried again.
  void start();
  /// Ends the thread and the connection.
  void close();

  /// A real-time task is connected and its cycle runs.
  [[nodiscard]] bool alive() const noexcept { return incarnation() != 0; }
  /// A task has been connected since the start: what the servant before this one has left is taken over.
  [[nodiscard]] bool has_been_attached() const noexcept { return has_been_attached_; }
  /// Of that task; 0 where there is none.
  [[nodiscard]] std::uint64_t incarnation() const noexcept {
    return incarnation_.load(std::memory_order_acquire);
  }
  /// The channel, of a task that lives or the last; null when there has been none. Stays mapped while the caller
  /// holds it.
  [[nodiscard]] std::shared_ptr<ServantChannel> channel() const;
  /// This is the number of the last stop that this servant knows of, or 0 where there has been no task. It takes no lock.
  [[nodiscard]] std::uint64_t stops() const noexcept;
  /// This counts a Stop and returns its number. It takes no lock, no memory and no system call.
  [[nodiscard]] std::uint64_t request_stop() noexcept;
  /// The newest snapshot; false when there has never been one.
  [[nodiscard]] bool snapshot(Snapshot& out) const;
  /// Until the listener has had every alarm that the task gave out before, and that of its loss. A client that has
  /// seen Error then finds its cause. As far as the link's thread reads them in time; never on that thread.
  void await_alarms() const;
  /// Why alive() is false, and what to do about it.
  [[nodiscard]] std::string cause() const;
  /// This servant's segment, which is there before any task is, and as long as this.
  [[nodiscard]] ServantSegment& own() const noexcept { return port_.own(); }

 private:
  /// The servant's ends of a channel's rings; the thread makes them anew for each connection.
  struct ReportRings;

  void run();
  [[nodiscard]] bool ending() const;
  /// One attempt; the cause is kept on failure.
  [[nodiscard]] std::shared_ptr<ServantChannel> try_connect(bool first);
  void set_cause(const std::string& cause);
  /// Until the task's cycle works for this servant; false when the task is gone before.
  [[nodiscard]] bool await_service(const ServantChannel& channel);
  void serve_until_gone(const ServantChannel& channel);
  void drain(const ServantChannel& channel, ReportRings& rings);
  void lose(const std::string& reason);

  const std::string name_;
  LinkListener& listener_;
  ServantPort port_;

  mutable std::mutex mutex_;  // of the members below, held for a moment only
  std::condition_variable end_requested_;
  std::condition_variable connected_;
  std::shared_ptr<ServantChannel> channel_;
  std::string cause_;
  bool end_{false};

  mutable std::mutex alarms_mutex_;  // of the two below
  mutable std::condition_variable alarms_reported_;
  std::uint64_t alarms_seen_{0};  // of the connected task's ring, those that the listener has had
  bool is_losing_{false};         // the listener does not know yet that the task is gone

  Published<ServantChannel> published_;        // it names what channel_ names, for readers that take no lock
  std::atomic<std::uint64_t> incarnation_{0};  // of the task that is alive; 0: none
  std::atomic<bool> has_been_attached_{false};
  std::thread thread_;
};

}  // namespace corbot
