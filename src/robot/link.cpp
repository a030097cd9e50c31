// SPDX-License-Identifier: Apache-2.0
#include "robot/link.h"

#include <fmt/format.h>

#include <chrono>
#include <cstdlib>
#include <utility>

#include "corbot/channel/wake.h"

namespace corbot {
namespace {

using namespace std::chrono_literals;

constexpr auto kRetry = 50ms;                      // between attempts to find a segment or a task
constexpr std::int64_t kPeerPoll_ns = 20'000'000;  // a dead task is noticed within this time
constexpr auto kSnapshotOfVerdict = 5ms;           // a verdict's snapshot follows it within a cycle

/// What to do depends on whether this servant is supervised, by `corbot up` or systemd: then the task is, too.
std::string task_is_gone(const std::string& name) {
  return fmt::format("the real-time task of {} is gone; {}", name,
                     std::getenv("NOTIFY_SOCKET") != nullptr ? "its supervisor is starting it again"
                                                             : "start corbot-rt again");
}

/// The newest snapshot of the segment's present task. None before its cycle runs: it may be approaching its
/// device still, and has not said what became of what it found in the segment.
bool running_snapshot(const SegmentLayout& layout, Snapshot& now) {
  return layout.snapshot.load(now) &&
         now.incarnation == layout.header.incarnation.load(std::memory_order_acquire);
}

std::string task_is_starting(const std::string& name) {
  return fmt::format("the real-time task of {} is starting, its cycle does not run yet", name);
}

}  // namespace

struct Link::ReportRings {
  explicit ReportRings(SegmentLayout& layout) : alarms(layout.alarms), completions(layout.completions) {}
  RingConsumer<decltype(SegmentLayout::alarms)> alarms;
  RingConsumer<decltype(SegmentLayout::completions)> completions;
};

Link::Link(std::string name, std::uint64_t fingerprint, LinkListener& listener)
    : name_(std::move(name)), fingerprint_(fingerprint), listener_(listener) {}

void Link::start() {
  try_attach(true);
  thread_ = std::thread([this] { run(); });
}

void Link::close() {
  {
    const std::lock_guard lock(mutex_);
    end_ = true;
  }
  end_requested_.notify_all();
  if (thread_.joinable()) thread_.join();
  incarnation_ = 0;
  const std::lock_guard lock(mutex_);
  if (segment_) segment_->leave();
  segment_.reset();
}

std::shared_ptr<Segment> Link::segment() const {
  const std::lock_guard lock(mutex_);
  return segment_;
}

bool Link::snapshot(Snapshot& out) const {
  const auto segment = this->segment();
  return segment && last_snapshot(segment->layout(), out);
}

std::string Link::cause() const {
  const std::lock_guard lock(mutex_);
  return cause_;
}

void Link::set_cause(const std::string& cause) {
  const std::lock_guard lock(mutex_);
  cause_ = cause;
}

bool Link::try_attach(bool first) {
  try {
    auto segment = std::make_shared<Segment>(Segment::attach(name_, fingerprint_));
    const std::lock_guard lock(mutex_);
    segment_ = std::move(segment);
    return true;
  } catch (const SegmentError& error) {
    // Only at the start: later, another servant in this one's place is a fault like any other, and may end.
    if (first && (error.kind() == SegmentError::Kind::kInUse || error.kind() == SegmentError::Kind::kBadName))
      throw;
    set_cause(
        error.kind() == SegmentError::Kind::kAbsent
            ? fmt::format("the real-time task of {} is not running; start it with 'corbot up' or corbot-rt",
                          name_)
            : error.what());
    return false;
  }
}

void Link::run() {
  std::unique_lock lock(mutex_);
  while (!end_) {
    auto segment = segment_;
    lock.unlock();
    if (!segment && try_attach(false)) segment = this->segment();
    if (segment && segment->peer_alive()) {
      if (Snapshot now{}; running_snapshot(segment->layout(), now)) {
        ReportRings rings(segment->layout());
        drain(*segment, rings);  // what an earlier servant or task left
        incarnation_.store(now.incarnation, std::memory_order_release);
        listener_.on_attached(std::exchange(has_been_attached_, true));
        serve_until_gone(*segment, rings);
      } else {
        set_cause(task_is_starting(name_));
      }
    } else if (segment && !segment->linked()) {
      const std::lock_guard again(mutex_);
      segment_.reset();  // the name may belong to a new file by now
    } else if (segment) {
      set_cause(task_is_gone(name_));
    }
    lock.lock();
    if (!end_) end_requested_.wait_for(lock, kRetry);
  }
}

void Link::serve_until_gone(Segment& segment, ReportRings& rings) {
  SegmentLayout& layout = segment.layout();
  for (;;) {
    {
      const std::lock_guard lock(mutex_);
      if (end_) return;
    }
    const std::uint32_t seen = layout.wake.load(std::memory_order_acquire);
    // Asked before the rings are drained: verdicts that a dying task still gave are not lost.
    const bool connected = segment.peer_alive();
    const bool same = layout.header.incarnation.load(std::memory_order_acquire) == incarnation();
    Snapshot before{};
    const bool has_snapshot = running_snapshot(layout, before);
    drain(segment, rings);
    if (same && has_snapshot) listener_.on_drained(before);
    if (!connected) {
      return lose(task_is_gone(name_));
    }
    if (!same) return lose("the real-time task was restarted; the running motion was lost with the old one");
    wait_change(layout.wake, seen, kPeerPoll_ns);
  }
}

void Link::drain(Segment& segment, ReportRings& rings) {
  SegmentLayout& layout = segment.layout();
  AlarmEvent alarm{};
  for (std::size_t i = 0; i < layout.alarms.capacity() && rings.alarms.pop(alarm) == PopResult::kOk; ++i) {
    listener_.on_alarm(alarm);
  }
  Completion completion{};
  for (std::size_t i = 0; i < layout.completions.capacity(); ++i) {
    if (rings.completions.pop(completion) != PopResult::kOk) return;
    // A cycle publishes its verdicts before its snapshot: a call that ends with the verdict must find the arm
    // at rest.
    const auto deadline = std::chrono::steady_clock::now() + kSnapshotOfVerdict;
    for (Snapshot now{}; (!layout.snapshot.load(now) || now.cycle < completion.cycle) &&
                         std::chrono::steady_clock::now() < deadline;) {
      std::this_thread::yield();
    }
    listener_.on_completion(completion);
  }
}

void Link::lose(const std::string& reason) {
  set_cause(reason);
  incarnation_.store(0, std::memory_order_release);
  listener_.on_lost(reason);
}

}  // namespace corbot
