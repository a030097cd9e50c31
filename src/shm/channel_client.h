// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "shm/message.h"
#include "shm/run_directory.h"
#include "shm/segment.h"

// The clients of a real-time task's socket. For set-up and tear-down only.

namespace corbot {

/// Reads a robot's channel: every write through it is a segmentation fault. It stays readable when the task
/// is gone; the next task has a channel of its own.
class Observer {
 public:
  /// Throws SegmentError: kAbsent if no task runs.
  [[nodiscard]] static Observer of(const std::string& robot);
  [[nodiscard]] const TaskSegment& task() const noexcept { return *task_; }
  /// Returns the segment of the last servant, or null if there was none.
  [[nodiscard]] const ServantSegment* servant() const noexcept { return servant_ ? &**servant_ : nullptr; }
  /// Returns true if the real-time task lives. One system call.
  [[nodiscard]] bool task_alive() const noexcept { return !is_closed(connection_); }

 private:
  Observer(Descriptor connection, Segment<const TaskSegment> task)
      : connection_(std::move(connection)), task_(std::move(task)) {}
  Descriptor connection_;
  Segment<const TaskSegment> task_;
  std::optional<Segment<const ServantSegment>> servant_;
};

/// Returns true if a real-time task of that robot lives. It may not respond.
[[nodiscard]] bool task_runs(const std::string& robot);

/// Stops a robot on this machine without its servant. Only the task's user and its stop group may do so.
class StopPort {
 public:
  /// Throws SegmentError: kAbsent if no task runs.
  [[nodiscard]] static StopPort of(const std::string& robot);
  /// Returns the process that listens as this robot's task.
  [[nodiscard]] pid_t task_pid() const noexcept { return peer_of(connection_).pid; }
  /// Counts a stop request.
  void request() noexcept;

  enum class Outcome {
    kPending,   ///< call outcome() again
    kAtRest,    ///< the stop is carried out, or an Error holds the arm after its ramp
    kTaskGone,  ///< only another task could move the arm, and needs another StopPort
  };
  /// Returns the result of request(). Counts the request again if it was removed before the task had read it:
  /// other members of the stop group may write the count, too.
  [[nodiscard]] Outcome outcome() noexcept;

 private:
  StopPort(Descriptor connection, Segment<const TaskSegment> task, Segment<StopSegment> stop)
      : connection_(std::move(connection)), task_(std::move(task)), stop_(std::move(stop)) {}
  /// Reads a snapshot of the task's own cycle; returns false before the first.
  [[nodiscard]] bool newest(Snapshot& out) const noexcept;
  Descriptor connection_;
  Segment<const TaskSegment> task_;
  Segment<StopSegment> stop_;
  std::optional<std::uint64_t> read_by_cycle_{};  ///< a cycle that has certainly read the request
  std::uint64_t stops_before_{0};                 ///< stops carried out before it
};

/// A servant's connection to one real-time task. It stays mapped when that task is gone.
class ServantChannel {
 public:
  ServantChannel(Descriptor connection, std::uint64_t session, Segment<const TaskSegment> task,
                 std::shared_ptr<Segment<ServantSegment>> own)
      : connection_(std::move(connection)), session_(session), task_(std::move(task)), own_(std::move(own)) {}

  [[nodiscard]] const TaskSegment& task() const noexcept { return *task_; }
  [[nodiscard]] ServantSegment& own() const noexcept { return **own_; }
  /// Returns the number of the last stop that this servant knows of. Motions planned from now on follow this
  /// stop.
  [[nodiscard]] std::uint64_t stops() const noexcept {
    Snapshot now{};
    std::atomic<std::uint64_t>& count = own().control.stop_count;
    return raise_stop_count(count, last_snapshot(task(), now) ? now.stops_done : count.load());
  }
  /// Counts a Stop and returns its number. The count is in the servant's own segment, so no other process can
  /// undo it.
  [[nodiscard]] std::uint64_t request_stop() const noexcept {
    (void)stops();
    return own().control.stop_count.fetch_add(1, std::memory_order_acq_rel) + 1;
  }
  [[nodiscard]] std::size_t queued() const noexcept {
    return ring_size(own().commands, task().commands_tail);
  }

  /// Returns true if the task lives. One system call.
  [[nodiscard]] bool task_alive() const noexcept { return !is_closed(connection_); }
  /// Closes the connection; no other thread may use it any more.
  void disconnect() noexcept { connection_ = Descriptor(); }
  /// Returns true if the task's cycle reads this servant's flags and commands, not a previous servant's.
  [[nodiscard]] bool is_served() const noexcept {
    Snapshot now{};
    return task().snapshot.load(now) && now.servant_session == session_;
  }

 private:
  friend class ServantPort;
  Descriptor connection_;
  std::uint64_t session_;
  Segment<const TaskSegment> task_;
  std::shared_ptr<Segment<ServantSegment>> own_;
};

/// The state that a servant finds when it connects to a task for the first time.
struct Inheritance {
  const ServantSegment* former;  ///< segment of the previous servant, unchecked; null: there was none
  const Snapshot* last;          ///< snapshot of the task, or of the previous task; null: there is none
};

/// The part of the channel that a servant has for as long as it lives. It consists of its own segment and a
/// descriptor of the last task's segment, which a new task gets back.
class ServantPort {
 public:
  /// Reads the previous servant's state, before the task works for this one. Called once.
  using Inherit = std::function<void(const Inheritance&)>;

  ServantPort(std::string robot, std::uint64_t fingerprint, Inherit inherit);
  ServantPort(const ServantPort&) = delete;
  ServantPort& operator=(const ServantPort&) = delete;
  ~ServantPort() = default;

  /// Makes one attempt; polls `cancelled` while it waits for an answer. Throws SegmentError.
  [[nodiscard]] std::shared_ptr<ServantChannel> connect(const std::function<bool()>& cancelled);
  [[nodiscard]] ServantSegment& own() const noexcept { return **own_; }

 private:
  void inherit(const Message& welcome, const TaskSegment& task, uid_t peer);

  const std::string robot_;
  const std::uint64_t fingerprint_;
  const Inherit inherit_;
  std::shared_ptr<Segment<ServantSegment>> own_;
  Descriptor last_task_;
  bool has_inherited_{false};
};

}  // namespace corbot
