// SPDX-License-Identifier: Apache-2.0
#include "rt/task_channel.h"

#include <spdlog/spdlog.h>
#include <time.h>
#include <unistd.h>

#include <array>
#include <chrono>
#include <cstddef>
#include <limits>
#include <stdexcept>
#include <utility>
#include <vector>

#include "notify/descriptor_store.h"
#include "notify/notify_address.h"

namespace corbot::rt {
namespace {

/// The wait for a living servant: it tries again every 50 ms.
constexpr std::chrono::milliseconds kWindow{1000};

/// The segments of successive tasks are kept under two names in turn. The new one is kept before the old one
/// is dropped, at whatever instant this process is killed.
constexpr const char* kTaskNames[] = {"corbot-task", "corbot-task-2"};
constexpr const char* kServantName = "corbot-servant";

ChannelPolicy supervised(ChannelPolicy policy) {
  policy.is_supervised = is_supervised();
  return policy;
}

struct Predecessor {
  std::optional<Segment<const TaskSegment>> task;
  std::size_t task_name{0};             ///< index into kTaskNames of its kept name
  std::array<bool, 2> is_name_taken{};  ///< also by a segment that is not taken over
  Descriptor servant;
};

bool is(const Segment<const TaskSegment>& task, std::optional<std::uint64_t> id) {
  return id && task->header.id == *id;
}

/// Takes the last task's segment from several ones, else the newest.
Predecessor take_kept(const std::string& robot, std::uint64_t fingerprint,
                      std::optional<std::uint64_t> last) {
  Predecessor kept;
  for (const KeptDescriptor& each : take_kept_descriptors()) {
    Descriptor descriptor(each.fd);
    if (each.name == kServantName) {
      kept.servant = std::move(descriptor);
    } else if (each.name == kTaskNames[0] || each.name == kTaskNames[1]) {
      const std::size_t name = each.name == kTaskNames[0] ? 0 : 1;
      kept.is_name_taken[name] = true;
      try {
        auto task =
            Segment<const TaskSegment>::open(std::move(descriptor), {robot, ::geteuid(), fingerprint});
        if (kept.task && !is(task, last) &&
            ((*kept.task)->incarnation >= task->incarnation || is(*kept.task, last)))
          continue;
        kept.task = std::move(task);
        kept.task_name = name;
      } catch (const SegmentError& error) {
        spdlog::warn("the stored segment of the previous task cannot be taken over: {}", error.what());
      }
    }
  }
  return kept;
}

/// Returns the name under which the segment that was taken over is not kept.
std::size_t free_name(const Predecessor& before) {
  if (before.task && before.is_name_taken[before.task_name]) return 1 - before.task_name;
  return before.is_name_taken[0] ? 1 : 0;
}

/// Tries until the supervisor's queue has room. A process that sends several messages at its start may find
/// it full.
bool keep_patiently(const char* name, int fd) noexcept {
  constexpr int kAttempts = 100;
  constexpr timespec kPause{0, 10'000'000};
  for (int attempt = 0; attempt < kAttempts; ++attempt) {
    if (keep_descriptor(name, fd)) return true;
    ::nanosleep(&kPause, nullptr);
  }
  return false;
}

/// Returns a different value for each task since the machine's start. A command planned before this task's
/// start is thus older than every stop that the task knows.
std::uint64_t time_since_boot_ns() noexcept {
  timespec now{};
  ::clock_gettime(CLOCK_BOOTTIME, &now);
  return static_cast<std::uint64_t>(now.tv_sec) * 1'000'000'000 + static_cast<std::uint64_t>(now.tv_nsec);
}

}  // namespace

TaskChannel::TaskChannel(const std::string& robot, std::uint64_t fingerprint, ChannelPolicy policy,
                         bool fresh, const std::atomic<bool>& cancelled)
    : task_(Segment<TaskSegment>::create(robot, fingerprint)),
      stop_(Segment<StopSegment>::create(robot, fingerprint)),
      server_(robot, fingerprint, supervised(policy)) {
  const std::optional<std::uint64_t> last = server_.last_task();
  Predecessor before = take_kept(robot, fingerprint, last);
  if (!before.task && server_.left_behind()) before.task = server_.await_predecessor(kWindow, cancelled);
  if (fresh) {
    if (server_.servant_waits()) throw std::runtime_error("--fresh: a servant uses the robot; end it first");
    before.task.reset();
    before.servant = {};
  }
  if (before.task && !is(*before.task, last)) {
    spdlog::warn(
        "a segment of an earlier real-time task was found, but a later task may have run, so this task does "
        "not take it over");
    refuse(**before.task);
    before.task.reset();
  }
  const std::uint64_t since_boot_ns = time_since_boot_ns();
  // Avoids the number of a task whose segment is lost: a servant may still hold that task's motions.
  task_->incarnation = since_boot_ns / 1'000'000 + 1;
  if (before.task) take_over(**before.task);
  stop_->count.store(since_boot_ns, std::memory_order_relaxed);

  const std::size_t name = free_name(before);
  is_last_ = is_supervised() && keep(name, before.is_name_taken[name]);
  server_.inherit_servant(std::move(before.servant));
  server_.serve(task_, stop_, mailbox_, [this](const Descriptor& servant) {
    // Nothing moves the arm earlier. Without a supervisor, another process has this task's segment only from
    // now on.
    if (!std::exchange(is_last_, true)) (void)server_.set_last_task(task_->header.id);
    (void)drop_descriptor(kServantName);
    (void)keep_descriptor(kServantName, servant.get());
  });
  spdlog::info("channel of {} at {}: {}", robot, server_.path(),
               before.task ? "takes over from an earlier real-time task" : "begins anew");
}

/// Keeps the segment under a name of its own, and then alone. It first drops a refused or older segment of
/// that name. It drops the previous task's segment when this one is known to be the last. Returns false if
/// the supervisor does not keep the segment.
bool TaskChannel::keep(std::size_t name, bool is_name_taken) {
  if (is_name_taken) (void)drop_descriptor(kTaskNames[name]);
  if (!keep_patiently(kTaskNames[name], task_.memory().get())) {
    spdlog::warn(
        "the supervisor cannot store this task's segment: the next task begins with an unverified position");
    return false;
  }
  if (!server_.set_last_task(task_->header.id))
    spdlog::warn("{}: cannot be written: the next task begins with an unverified position", server_.path());
  (void)drop_descriptor(kTaskNames[1 - name]);
  return true;
}

/// The position may be older than the arm's present one. An Error that was not cleared still counts.
void TaskChannel::refuse(const TaskSegment& before) noexcept {
  Snapshot then{};
  const bool was_in_error = last_snapshot(before, then) && then.state == RtState::kError;
  if (was_in_error || before.stop_seen.load(std::memory_order_acquire) != 0) task_->stop_seen.store(1);
}

/// Takes over before any other process sees the segment. The users check the values.
void TaskChannel::take_over(const TaskSegment& before) noexcept {
  constexpr std::uint64_t kMost = std::numeric_limits<std::uint64_t>::max() / 2;
  task_->incarnation = before.incarnation < kMost ? before.incarnation + 1 : 2;
  task_->stop_seen.store(before.stop_seen.load(std::memory_order_acquire) != 0 ? 1 : 0);
  Snapshot last{};
  if (!last_snapshot(before, last)) return;
  last.servant_session = 0;  // of this task, none yet
  last.backlog = 0;
  task_->snapshot.store(last);
}

}  // namespace corbot::rt
