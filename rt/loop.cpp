// SPDX-License-Identifier: Apache-2.0
#include "rt/loop.h"

#include <time.h>

#include <algorithm>
#include <cerrno>

#include "corbot/channel/wake.h"
#include "rt/wall_clock.h"

namespace corbot::rt {
namespace {

constexpr std::uint64_t kCyclesPerReport = 100;

std::int64_t read_clock_ns(clockid_t clock) noexcept {
  timespec time{};
  clock_gettime(clock, &time);  // through the vDSO
  return std::int64_t{time.tv_sec} * 1'000'000'000 + time.tv_nsec;
}

void sleep_until(std::int64_t due_ns) noexcept {
  timespec due{};
  due.tv_sec = static_cast<time_t>(due_ns / 1'000'000'000);
  due.tv_nsec = static_cast<long>(due_ns % 1'000'000'000);
  while (clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &due, nullptr) == EINTR) {
  }
}

}  // namespace

std::size_t latency_bucket(std::int64_t latency_ns) noexcept {
  std::size_t bucket = 0;
  while (bucket + 1 < kLatencyBuckets && latency_ns >= latency_edge_ns(bucket)) ++bucket;
  return bucket;
}

Loop::Loop(Cycle& cycle, TaskSegment& segment, const LoopSettings& settings) noexcept
    : cycle_(cycle), segment_(segment), settings_(settings) {
  diagnostics_.period_ns = settings.period_ns;
  diagnostics_.realtime = settings.realtime ? 1 : 0;
  diagnostics_.priority = static_cast<std::uint32_t>(settings.priority);
  diagnostics_.since_wall_ns = read_clock_ns(CLOCK_REALTIME);
  segment_.diagnostics.store(diagnostics_);
}

void Loop::run(const std::atomic<bool>& stop) noexcept {
  due_ns_ = read_clock_ns(CLOCK_MONOTONIC) + settings_.period_ns;
  for (;;) {
    sleep_until(due_ns_);
    const std::int64_t woken_ns = read_clock_ns(CLOCK_MONOTONIC);
    count_latency(woken_ns - due_ns_);
    skip_overslept(woken_ns);
    watch_suspension(woken_ns);
    const std::int64_t wall_ns = due_ns_ + wall_offset_ns(read_clock_ns);

    const bool ending = stop.load(std::memory_order_relaxed);
    if (ending) cycle_.begin_shutdown();
    const StepReport report = cycle_.step(due_ns_, wall_ns);
    if (report.published) wake_one(segment_.wake);
    if (ending && report.at_rest) break;

    const std::int64_t done_ns = read_clock_ns(CLOCK_MONOTONIC);
    diagnostics_.work_max_ns = std::max(diagnostics_.work_max_ns, done_ns - woken_ns);
    due_ns_ += settings_.period_ns;
    count_missed(done_ns);
    if (++diagnostics_.cycles % kCyclesPerReport == 0) segment_.diagnostics.store(diagnostics_);
  }
  segment_.diagnostics.store(diagnostics_);
}

void Loop::count_latency(std::int64_t latency_ns) noexcept {
  ++diagnostics_.latency[latency_bucket(latency_ns)];
  diagnostics_.latency_sum_ns += latency_ns;
  diagnostics_.latency_max_ns = std::max(diagnostics_.latency_max_ns, latency_ns);
}

/// Skips the periods overslept after a late wake-up. The step gets the newest instant of the grid, so that
/// the cycle sees the gap in the next step.
void Loop::skip_overslept(std::int64_t woken_ns) noexcept {
  const std::int64_t missed = (woken_ns - due_ns_) / settings_.period_ns;
  if (missed > 0) {
    due_ns_ += missed * settings_.period_ns;
    if (!is_overrun_counted_) count_overrun();
  }
  is_overrun_counted_ = false;
}

/// Counts suspensions: during one neither stops nor devices are watched, and servos may be without power.
void Loop::watch_suspension(std::int64_t woken_ns) noexcept {
  const std::int64_t boot_ns = read_clock_ns(CLOCK_BOOTTIME);
  cycle_.count_suspension(suspension_.see(woken_ns, boot_ns, read_clock_ns(CLOCK_MONOTONIC)));
}

void Loop::count_overrun() noexcept {
  ++diagnostics_.overruns;
  cycle_.count_overrun();
}

void Loop::count_missed(std::int64_t now_ns) noexcept {
  if (now_ns <= due_ns_) return;
  // One overrun counts once, however many periods it took; the next step is on the grid again.
  count_overrun();
  is_overrun_counted_ = true;
  const std::int64_t missed = (now_ns - due_ns_) / settings_.period_ns + 1;
  due_ns_ += missed * settings_.period_ns;
}

}  // namespace corbot::rt
