// SPDX-License-Identifier: Apache-2.0
#include "robot/link.h"

#include <fmt/format.h>
#include <pthread.h>

#include <chrono>
#include <utility>

#include "corbot/channel/wake.h"
#include "corbot/running_time.h"
#include "notify/notify_address.h"

namespace corbot {
namespace {

using namespace std::chrono_literals;

constexpr auto kRetry = 50ms;  // between attempts to find a task
constexpr auto kFirstService = 1s;
constexpr std::int64_t kPeerPoll_ns = 20'000'000;  // longest time until the death of a task is detected
constexpr std::int64_t kServicePoll_ns = 2'000'000;
constexpr auto kAlarmsRead = 1s;
constexpr auto kSnapshotOfVerdict =
    5ms;  // longest wait for a verdict's snapshot, which follows within a cycle

/// Describes the loss of the task. A supervisor of this servant (`corbot up` or systemd) supervises the task,
/// too, and restarts it.
std::string task_is_gone(const std::string& name) {
  return fmt::format("the real-time task of {} is gone; {}", name,
                     is_supervised() ? "its supervisor is starting it again" : "start corbot-rt again");
}

std::string task_is_absent(const std::string& name) {
  return fmt::format("the real-time task of {} is not running; {}", name,
                     is_supervised() ? "its supervisor starts it" : "start it with 'corbot up' or corbot-rt");
}

std::string task_is_starting(const std::string& name) {
  return fmt::format("the real-time task of {} is starting, its cycle does not run yet", name);
}

}  // namespace

struct Link::ReportRings {
  explicit ReportRings(const ServantChannel& channel)
      : alarms(channel.task().alarms, channel.own().alarms_tail),
        completions(channel.task().completions, channel.own().completions_tail) {}
  RingConsumer<decltype(TaskSegment::alarms)> alarms;
  RingConsumer<decltype(TaskSegment::completions)> completions;
};

Link::Link(std::string name, std::uint64_t fingerprint, LinkListener& listener)
    : name_(std::move(name)),
      listener_(listener),
      port_(name_, fingerprint,
            [this](const Inheritance& inheritance) { listener_.on_inherit(inheritance); }) {}

void Link::start() {
  auto channel = try_connect(true);
  published_.replace(channel.get());
  std::unique_lock lock(mutex_);
  channel_ = std::move(channel);
  const bool is_connected = channel_ != nullptr;
  thread_ = std::thread([this] { run(); });
  // A servant that reports "ready" can work, unless its task still has to move the arm to its start position.
  if (is_connected) connected_.wait_for(lock, kFirstService, [this] { return alive(); });
}

void Link::close() {
  {
    const std::lock_guard lock(mutex_);
    end_ = true;
  }
  end_requested_.notify_all();
  const bool was_running = thread_.joinable();
  if (was_running) thread_.join();
  incarnation_ = 0;
  if (!was_running) return;
  std::shared_ptr<ServantChannel> last;
  {
    const std::lock_guard lock(mutex_);
    channel_.swap(last);
  }
  published_.replace(nullptr);
  if (last) last->disconnect();
  last.reset();
  // If the task ended first, the servant removes the leftover socket. Under a supervisor it does not: the
  // next task reads from it whose segment was the last.
  if (!is_supervised()) remove_left_behind(name_);
}

bool Link::ending() const {
  const std::lock_guard lock(mutex_);
  return end_;
}

std::shared_ptr<ServantChannel> Link::channel() const {
  const std::lock_guard lock(mutex_);
  return channel_;
}

std::uint64_t Link::stops() const noexcept {
  return published_.read(
      [](const ServantChannel* channel) { return channel != nullptr ? channel->stops() : 0; });
}

std::uint64_t Link::request_stop() noexcept {
  return published_.read([this](const ServantChannel* channel) {
    return channel != nullptr ? channel->request_stop()
                              : own().control.stop_count.fetch_add(1, std::memory_order_acq_rel) + 1;
  });
}

bool Link::snapshot(Snapshot& out) const {
  const auto channel = this->channel();
  return channel && last_snapshot(channel->task(), out);
}

void Link::await_alarms() const {
  const auto channel = this->channel();
  if (!channel) return;
  const std::uint64_t given = channel->task().alarms.published();
  const auto are_read = [&] { return alive() ? alarms_seen_ >= given : !is_losing_; };
  std::unique_lock lock(alarms_mutex_);
  for (Patience patience(kAlarmsRead); !patience.is_over();) {
    if (alarms_reported_.wait_for(lock, Patience::kLongestLook, are_read)) return;
  }
}

std::string Link::cause() const {
  const std::lock_guard lock(mutex_);
  return cause_;
}

void Link::set_cause(const std::string& cause) {
  const std::lock_guard lock(mutex_);
  cause_ = cause;
}

std::shared_ptr<ServantChannel> Link::try_connect(bool first) {
  try {
    return port_.connect([this] { return ending(); });
  } catch (const SegmentError& error) {
    // The first attempt only: later, another servant in this one's place is a fault like any other, and may
    // go away.
    if (first && (error.kind() == SegmentError::Kind::kInUse || error.kind() == SegmentError::Kind::kBadName))
      throw;
    set_cause(error.kind() == SegmentError::Kind::kAbsent ? task_is_absent(name_) : error.what());
    return nullptr;
  }
}

void Link::run() {
  ::pthread_setname_np(::pthread_self(), "robot.link");
  std::shared_ptr<ServantChannel> channel = this->channel();
  std::unique_lock lock(mutex_);
  while (!end_) {
    lock.unlock();
    if (!channel) channel = try_connect(false);
    if (channel && await_service(*channel)) {
      // The previous channel is destroyed outside the lock, which every call takes.
      std::shared_ptr<ServantChannel> former = channel;
      {
        const std::lock_guard again(mutex_);
        channel_.swap(former);
      }
      published_.replace(channel.get());
      former.reset();
      serve_until_gone(*channel);
    }
    channel.reset();  // channel_ stays readable until the next connection
    lock.lock();
    if (!end_) end_requested_.wait_for(lock, kRetry);
  }
}

bool Link::await_service(const ServantChannel& channel) {
  set_cause(task_is_starting(name_));
  while (!channel.is_served()) {
    if (ending()) return false;
    if (!channel.task_alive()) {
      set_cause(task_is_gone(name_));
      return false;
    }
    const std::uint32_t seen = channel.task().wake.load(std::memory_order_acquire);
    wait_change(channel.task().wake, seen, kServicePoll_ns);
  }
  return true;
}

void Link::serve_until_gone(const ServantChannel& channel) {
  ReportRings rings(channel);
  drain(channel, rings);  // reports that an earlier servant has not read
  {
    const std::lock_guard lock(mutex_);
    incarnation_.store(channel.task().incarnation, std::memory_order_release);
  }
  listener_.on_attached(has_been_attached_.exchange(true));
  connected_.notify_all();
  while (!ending()) {
    const std::atomic<std::uint32_t>& wake = channel.task().wake;
    const std::uint32_t seen = wake.load(std::memory_order_acquire);
    // Read before the rings are drained, so that the last verdicts of a dying task are not lost.
    const bool lives = channel.task_alive();
    Snapshot before{};
    const bool has_snapshot = channel.task().snapshot.load(before);
    drain(channel, rings);
    if (has_snapshot) listener_.on_drained(before);
    if (!lives) return lose(task_is_gone(name_));
    wait_change(wake, seen, kPeerPoll_ns);
  }
}

void Link::drain(const ServantChannel& channel, ReportRings& rings) {
  const TaskSegment& task = channel.task();
  AlarmEvent alarm{};
  for (std::size_t i = 0; i < task.alarms.capacity() && rings.alarms.pop(alarm) == PopResult::kOk; ++i) {
    listener_.on_alarm(alarm);
  }
  {
    const std::lock_guard lock(alarms_mutex_);
    alarms_seen_ = channel.own().alarms_tail.taken();
  }
  alarms_reported_.notify_all();
  Completion completion{};
  for (std::size_t i = 0; i < task.completions.capacity(); ++i) {
    if (rings.completions.pop(completion) != PopResult::kOk) return;
    // A cycle publishes its verdicts before its snapshot. A call that ends with the verdict must find the arm
    // at rest.
    const auto deadline = std::chrono::steady_clock::now() + kSnapshotOfVerdict;
    for (Snapshot now{}; (!task.snapshot.load(now) || now.cycle < completion.cycle) &&
                         std::chrono::steady_clock::now() < deadline;) {
      std::this_thread::yield();
    }
    listener_.on_completion(completion);
  }
}

void Link::lose(const std::string& reason) {
  set_cause(reason);
  const auto set_losing = [this](bool is_losing) {
    const std::lock_guard lock(alarms_mutex_);
    is_losing_ = is_losing;
  };
  set_losing(true);
  incarnation_.store(0, std::memory_order_release);
  listener_.on_lost(reason);
  set_losing(false);
  alarms_reported_.notify_all();
}

}  // namespace corbot
