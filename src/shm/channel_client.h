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

// The other ends of a real-time task's socket. Set-up and tear-down only.

namespace corbot {

/// Reads a robot's channel: every write through it is a segmentation fault. Stays readable when the task is
/// gone; a task that comes after it has a channel of its own.
class Observer {
 public:
  /// Throws SegmentError: kAbsent where no task runs.
  [[nodiscard]] static Observer of(const std::string& robot);
  [[nodiscard]] const TaskSegment& task() const noexcept { return *task_; }
  /// That of the last servant; null when there has been none.
  [[nodiscard]] const ServantSegment* servant() const noexcept { return servant_ ? &**servant_ : nullptr; }
  /// Does the real-time task live? One system call.
  [[nodiscard]] bool task_alive() const noexcept { return !is_closed(connection_); }

 private:
  Observer(Descriptor connection, Segment<const TaskSegment> task)
      : connection_(std::move(connection)), task_(std::move(task)) {}
  Descriptor connection_;
  Segment<const TaskSegment> task_;
  std::optional<Segment<const ServantSegment>> servant_;
};

/// Does a real-time task of that robot live? It may not respond.
[[nodiscard]] bool task_runs(const std::string& robot);

/// Stops a robot on this machine without its servant: allowed to the task's user and to its stop group.
class StopPort {
 public:
  /// Throws SegmentError: kAbsent where no task runs.
  [[nodiscard]] static StopPort of(const std::string& robot);
  /// Counts a stop request.
  void request() noexcept;

  enum class Outcome {
    kPending,   ///< ask again
    kAtRest,    ///< carried out; or an Error holds the arm
    kTaskGone,  ///< nothing moves but by another task, which needs another StopPort
  };
  /// What has become of request(). Counts it again where it was taken back before the task had read it:
  /// others of the stop group may write the count, too.
  [[nodiscard]] Outcome outcome() noexcept;

 private:
  StopPort(Descriptor connection, Segment<const TaskSegment> task, Segment<StopSegment> stop)
      : connection_(std::move(connection)), task_(std::move(task)), stop_(std::move(stop)) {}
  /// Of the task's own cycle; false before the first.
  [[nodiscard]] bool newest(Snapshot& out) const noexcept;
  Descriptor connection_;
  Segment<const TaskSegment> task_;
  Segment<StopSegment> stop_;
  std::optional<std::uint64_t> read_by_cycle_{};  ///< the cycle that has read the request for certain
  std::uint64_t stops_before_{0};                 ///< carried out before it
};

/// A servant's connection to one real-time task. Stays mapped when that task is gone.
class ServantChannel {
 public:
  ServantChannel(Descriptor connection, std::uint64_t session, Segment<const TaskSegment> task,
                 std::shared_ptr<Segment<ServantSegment>> own)
      : connection_(std::move(connection)), session_(session), task_(std::move(task)), own_(std::move(own)) {}

  [[nodiscard]] const TaskSegment& task() const noexcept { return *task_; }
  [[nodiscard]] ServantSegment& own() const noexcept { return **own_; }
  /// Number of the last stop that this servant knows of: what is planned from now on comes after it.
  [[nodiscard]] std::uint64_t stops() const noexcept {
    Snapshot now{};
    std::atomic<std::uint64_t>& count = own().control.stop_count;
    return raise_stop_count(count, last_snapshot(task(), now) ? now.stops_done : count.load());
  }
  /// Counts a Stop; its number. No other process can take it back: it is in the servant's own segment.
  [[nodiscard]] std::uint64_t request_stop() const noexcept {
    (void)stops();
    return own().control.stop_count.fetch_add(1, std::memory_order_acq_rel) + 1;
  }
  [[nodiscard]] std::size_t queued() const noexcept {
    return ring_size(own().commands, task().commands_tail);
  }

  /// Does the task live? One system call.
  [[nodiscard]] bool task_alive() const noexcept { return !is_closed(connection_); }
  /// Nobody else may use it any more.
  void disconnect() noexcept { connection_ = Descriptor(); }
  /// Does its cycle read this servant's flags and commands, and not a former one's?
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

/// What a servant finds when it connects to a task for the first time.
struct Inheritance {
  const ServantSegment* former;  ///< what the servant before it has left, unchecked; null: there was none
  const Snapshot* last;          ///< of the task, or of the one before it; null: there is none
};

/// What a servant has of the channel for as long as it lives: its own segment, and a descriptor of the last
/// task's, which a new task gets back.
class ServantPort {
 public:
  /// Reads what a former servant left, before the task works for this one. Once.
  using Inherit = std::function<void(const Inheritance&)>;

  ServantPort(std::string robot, std::uint64_t fingerprint, Inherit inherit);
  ServantPort(const ServantPort&) = delete;
  ServantPort& operator=(const ServantPort&) = delete;
  ~ServantPort() = default;

  /// One attempt; `cancelled` is asked while it waits for an answer. Throws SegmentError.
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
