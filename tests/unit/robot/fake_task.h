// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <fcntl.h>
#include <gtest/gtest.h>

#include <atomic>
#include <deque>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <utility>

#include "config/segment_fingerprint.h"
#include "corbot/channel/wake.h"
#include "shm/channel_client.h"
#include "shm/channel_server.h"

namespace corbot::test {

/// Holds the channel's part of a task in this process. Each has an incarnation of its own.
struct TaskEnd {
  /// `former`: the segment of the servant that worked with the task before; may be empty.
  TaskEnd(const std::string& name, const ArmModel& arm, Descriptor former = Descriptor())
      : task(Segment<TaskSegment>::create(name, segment_fingerprint(arm))),
        stop(Segment<StopSegment>::create(name, segment_fingerprint(arm))),
        server(name, segment_fingerprint(arm), {}) {
    static std::atomic<std::uint64_t> incarnation{0};
    task->incarnation = ++incarnation;
    server.inherit_servant(std::move(former));
    server.serve(task, stop, servants, [this](const Descriptor& servant) {
      const std::lock_guard lock(mutex);
      kept = Descriptor(::fcntl(servant.get(), F_DUPFD_CLOEXEC, 0));
    });
  }
  std::mutex mutex;  // of kept
  Descriptor kept;   ///< the segment of the last servant
  Segment<TaskSegment> task;
  Segment<StopSegment> stop;
  ServantMailbox servants;
  ChannelServer server;  // its thread uses all of the above
};

/// A real-time task whose every answer the test gives. While it runs, its cycle number rises, and it works
/// for the servant that connects.
class FakeTask {
 public:
  FakeTask(const std::string& name, const ArmModel& arm) : name_(name), arm_(arm) { adopt(); }
  FakeTask(const FakeTask&) = delete;
  FakeTask& operator=(const FakeTask&) = delete;
  ~FakeTask() { die(); }

  /// Closes the connections, as death does.
  void die() {
    stop_running();
    servant_ = nullptr;
    backlog_.clear();
    end_.reset();
  }
  /// Listens, with an incarnation of its own; the cycle does not run yet.
  void adopt(Descriptor former = Descriptor()) { end_.emplace(name_, arm_, std::move(former)); }
  /// Returns the segment that a supervisor keeps for the next task: of the servant that is connected, or was.
  Descriptor kept_servant() {
    const std::lock_guard lock(end_->mutex);
    return std::move(end_->kept);
  }
  void run() {
    snapshot_.incarnation = end_->task->incarnation;
    snapshot_.servant_session = 0;
    ending_ = false;
    thread_ = std::thread([this] {
      while (!ending_) {
        change([](Snapshot&) {});
        const timespec period{0, 1'000'000};
        ::nanosleep(&period, nullptr);
      }
    });
  }

  /// Stands still from now on, inside the store of its snapshot: as where another process has the processor.
  void stand_inside_store() {
    stop_running();
    // The cell begins with its sequence, which is odd during a store.
    reinterpret_cast<std::atomic<std::uint64_t>&>(end_->task->snapshot) |= 1;
  }
  /// Changes the snapshot and publishes it.
  template <class Change>
  void change(Change&& how) {
    const std::lock_guard lock(mutex_);
    ++snapshot_.cycle;
    connect();
    how(snapshot_);
    end_->task->snapshot.store(snapshot_);
    // As the cycle does: where this thread is interrupted inside the store, readers find the snapshot before.
    end_->task->trace.append(snapshot_);
    wake_one(end_->task->wake);
  }
  /// The command that is next in the ring has its verdict; the snapshot follows.
  void complete(Verdict verdict) {
    const Command command = take();
    change([&](Snapshot& now) {
      ASSERT_TRUE(RingProducer(end_->task->completions, servant_.load()->completions_tail)
                      .push({command.id, verdict, 0, now.cycle}));
      end(now, command);
    });
  }
  /// It has ended, and the record of how is lost.
  void lose_verdict() {
    const Command command = take();
    change([&](Snapshot& now) { end(now, command); });
  }
  /// The command that is next runs from now on.
  void begin() {
    change([](Snapshot& now) {
      now.command_id = now.last_done_id + 1;
      now.state = RtState::kMoving;
    });
  }
  /// Goes into Error, with this cause.
  void fail(AlarmEvent cause) {
    change([&](Snapshot& now) {
      cause.time_ns = 1'700'000'000'000'000'000 + static_cast<std::int64_t>(now.cycle);
      ASSERT_TRUE(RingProducer(end_->task->alarms, servant_.load()->alarms_tail).push(cause));
      now.state = RtState::kError;
    });
  }
  /// The command that is next in the ring, which is taken.
  [[nodiscard]] Command next() { return take(); }
  [[nodiscard]] std::uint64_t epoch_of_next() { return take().epoch; }
  [[nodiscard]] TaskSegment& task() { return *end_->task; }
  /// Returns the number of Stops that the servant has requested.
  [[nodiscard]] std::uint64_t stop_count() const {
    const ServantSegment* const servant = servant_.load();
    return servant == nullptr ? 0 : servant->control.stop_count.load();
  }
  [[nodiscard]] const ServantSegment& servant() const { return *servant_.load(); }
  [[nodiscard]] std::size_t queued() const {
    return ring_size(servant_.load()->commands, end_->task->commands_tail);
  }

 private:
  void end(Snapshot& now, const Command& command) {
    now.last_done_id = command.id;
    now.backlog = static_cast<std::uint32_t>(backlog_.size());
    if (now.command_id != command.id) return;
    now.command_id = 0;
    now.state = RtState::kStandby;
  }
  void stop_running() {
    ending_ = true;
    if (thread_.joinable()) thread_.join();
  }
  /// As a cycle does with a servant that has just come.
  void connect() {
    const ServantOffer* const offer = end_->servants.take();
    if (offer == nullptr) return;
    if (servant_.load() != nullptr) {
      for (RingConsumer former(servant_.load()->commands, end_->task->commands_tail);;) {
        Command command{};
        if (former.pop(command) != PopResult::kOk) break;
        backlog_.push_back(command);
      }
    }
    snapshot_.backlog = static_cast<std::uint32_t>(backlog_.size());
    servant_ = offer->segment;
    RingConsumer(servant_.load()->commands, end_->task->commands_tail).clear();
    if (snapshot_.command_id == 0 && backlog_.empty())
      snapshot_.last_done_id = servant_.load()->next_command_id.load() - 1;
    snapshot_.servant_session = offer->session;
    end_->servants.confirm(offer->session);
  }
  Command take() {
    const std::lock_guard lock(mutex_);
    Command command{};
    if (!backlog_.empty()) {
      command = backlog_.front();
      backlog_.pop_front();
      return command;
    }
    EXPECT_EQ(RingConsumer(servant_.load()->commands, end_->task->commands_tail).pop(command),
              PopResult::kOk);
    return command;
  }

  const std::string name_;
  const ArmModel arm_;
  std::optional<TaskEnd> end_;
  std::atomic<const ServantSegment*> servant_{nullptr};  ///< set by the thread, read by the test
  std::mutex mutex_;                                     // of the two below
  std::deque<Command> backlog_;
  Snapshot snapshot_{};
  std::atomic<bool> ending_{false};
  std::thread thread_;
};

}  // namespace corbot::test
