// SPDX-License-Identifier: Apache-2.0
#include "rt/backends/gpio/gpiod.h"

#include <sys/prctl.h>
#include <time.h>

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstring>
#include <system_error>
#include <utility>

#include "rt/threads/thread_priority.h"

namespace corbot::rt {
namespace {

using namespace std::chrono_literals;
using Clock = std::chrono::steady_clock;

constexpr auto kReportEvery = 60s;
constexpr auto kThreadBeginsWithin = 2s;
constexpr int kTimings = 16;
constexpr std::int64_t kLongestSet_ns = 20'000;  ///< a pulse is never begun to end earlier than this allows

std::int64_t monotonic_ns() noexcept {
  timespec time{};
  ::clock_gettime(CLOCK_MONOTONIC, &time);
  return std::int64_t{time.tv_sec} * 1'000'000'000 + time.tv_nsec;
}

void rest_until(std::int64_t due_ns) noexcept {
  timespec due{};
  due.tv_sec = static_cast<time_t>(due_ns / 1'000'000'000);
  due.tv_nsec = static_cast<long>(due_ns % 1'000'000'000);
  while (::clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &due, nullptr) == EINTR) {
  }
}

std::int64_t width_ns(double pulse_us) {
  if (!(pulse_us > 0.0)) return 0;
  return std::llround(std::min(pulse_us * 1000.0, static_cast<double>(kLongestPulse_ns)));
}

}  // namespace

Gpiod::Gpiod(GpiodSettings settings, std::unique_ptr<GpioChips> chips)
    : settings_(std::move(settings)),
      chips_(std::move(chips)),
      frame_ns_(std::llround(1e9 / settings_.frame_hz)) {}

std::string Gpiod::open() {
  close();
  outputs_ = chips_->outputs({settings_.chip, settings_.lines, false, GpioBias::kAsIs, "corbot servos"});
  widths_.store(PulseWidths{});
  error_.store(0, std::memory_order_relaxed);
  end_.store(false, std::memory_order_relaxed);
  is_realtime_.store(-1, std::memory_order_relaxed);
  next_report_ = Clock::now() + kReportEvery;
  try {
    thread_ = std::thread([this] { run(); });
  } catch (const std::system_error& error) {
    throw DeviceError(DeviceCause::kNotThere, settings_.chip + ": no thread for the pulses: " + error.what());
  }
  const auto deadline = Clock::now() + kThreadBeginsWithin;
  while (is_realtime_.load(std::memory_order_acquire) < 0 && Clock::now() < deadline) {
    std::this_thread::sleep_for(1ms);
  }
  const bool is_realtime = is_realtime_.load(std::memory_order_acquire) > 0;
  return "GPIO on " + settings_.chip + ": " + std::to_string(settings_.lines.size()) + " servos, " +
         (is_realtime ? "timed at SCHED_FIFO " + std::to_string(settings_.priority)
                      : std::string("timed without real-time priority: expect servos that twitch"));
}

void Gpiod::close() noexcept {
  end_.store(true, std::memory_order_relaxed);
  if (thread_.joinable()) {
    thread_.join();
    if (lateness_.total() > 0) log_ = lateness_.text();
  }
  outputs_.reset();
}

void Gpiod::check_edges() const {
  if (const int error = error_.load(std::memory_order_acquire); error != 0) {
    throw DeviceError(DeviceCause::kHungUp, settings_.chip + ": " + std::strerror(error));
  }
}

bool Gpiod::send(const ServoFrame& frame, bool) {
  check_edges();
  PulseWidths widths;
  widths.count = static_cast<std::uint32_t>(std::min(settings_.lines.size(), kMaxServos));
  for (std::size_t i = 0; i < std::min<std::size_t>(frame.servo_count, kMaxServos); ++i) {
    if (frame.channel[i] < widths.count) widths.width_ns[frame.channel[i]] = width_ns(frame.pulse_us[i]);
  }
  widths_.store(widths);
  if (Clock::now() < next_report_) return true;
  next_report_ += kReportEvery;
  log_ = lateness_.text();
  return true;
}

BusReading Gpiod::measure(const ServoFrame&) {
  check_edges();
  return {};  // released lines hold no state
}

std::string Gpiod::drain_log() { return std::exchange(log_, {}); }

bool Gpiod::take_priority() noexcept {
  if (settings_.cpu >= 0) (void)bind_to_cpu(settings_.cpu);
  // An ordinary thread would be woken up to 50 us late, to save power.
  (void)::prctl(PR_SET_TIMERSLACK, 1ul);
  return settings_.priority > 0 && set_fifo_priority(settings_.priority) == 0;
}

/// Real-time from here on: no allocation, no lock; sleeping and setting lines are its only system calls.
void Gpiod::run() noexcept {
  is_realtime_.store(take_priority() ? 1 : 0, std::memory_order_release);
  time_setting();
  PulseWidths widths;
  std::int64_t begin_ns = monotonic_ns() + frame_ns_;
  while (!end_.load(std::memory_order_relaxed) && error_.load(std::memory_order_relaxed) == 0) {
    rest_until(begin_ns);
    (void)widths_.load(widths);  // torn: take those of the last frame once more
    make_frame(plan_pulses(widths, frame_ns_, settings_.order), begin_ns);
    begin_ns += frame_ns_;
    // Skips a missed frame: pulses that follow each other too soon would harm a servo.
    if (const std::int64_t behind_ns = monotonic_ns() - begin_ns; behind_ns > 0) {
      begin_ns += (behind_ns / frame_ns_ + 1) * frame_ns_;
    }
  }
  set(0);
}

void Gpiod::make_frame(const PulsePlan& plan, std::int64_t begin_ns) noexcept {
  for (std::uint32_t g = 0; g < plan.group_count; ++g) {
    const PulseGroup& group = plan.groups[g];
    rest_until(begin_ns + group.rise_ns);
    std::uint32_t high = group.lines;
    set(high);
    const std::int64_t rose_ns = monotonic_ns();
    for (std::uint32_t f = 0; f < group.fall_count; ++f) {
      high &= ~group.falls[f].lines;
      lower_at(rose_ns + group.falls[f].after_ns, high);
    }
  }
}

/// Counts the instant at which the lines have been set, as for the rise.
void Gpiod::lower_at(std::int64_t due_ns, std::uint32_t high) noexcept {
  const std::int64_t begin_ns = due_ns - quickest_set_ns_;
  rest_until(begin_ns - settings_.awake_ns);
  std::int64_t begun_ns = monotonic_ns();
  while (begun_ns < begin_ns) begun_ns = monotonic_ns();
  set(high);
  const std::int64_t done_ns = monotonic_ns();
  quickest_set_ns_ = std::min(quickest_set_ns_, done_ns - begun_ns);
  lateness_.count(done_ns - due_ns);
}

/// Measures the time of setting lines. It sets low lines low, often enough that at least one try is
/// undisturbed.
void Gpiod::time_setting() noexcept {
  quickest_set_ns_ = kLongestSet_ns;
  for (int i = 0; i < kTimings; ++i) {
    const std::int64_t begun_ns = monotonic_ns();
    set(0);
    quickest_set_ns_ = std::min(quickest_set_ns_, monotonic_ns() - begun_ns);
  }
}

void Gpiod::set(std::uint32_t lines) noexcept {
  const int error = outputs_->set(lines);
  if (error != 0) error_.store(error, std::memory_order_release);
}

}  // namespace corbot::rt
