// SPDX-License-Identifier: Apache-2.0
#include "rt/backends/bus_backend.h"

#include <algorithm>
#include <utility>

namespace corbot::rt {
namespace {

using Clock = std::chrono::steady_clock;

constexpr double kSlowestReopen = 10.0;  // times the first pause

}  // namespace

BusBackend::BusBackend(const ArmModel& arm, std::unique_ptr<BusDevice> device, BusSettings settings)
    : arm_(arm), device_(std::move(device)), settings_(std::move(settings)) {}

void BusBackend::open(const ServoFrame& first) {
  newest_.store(first);
  tell(device_->open());  // the operator hears of a missing device at once, not by an alarm
  exchange(true);
  (void)pause(device_->approach_ns());
  health_.store(BackendHealth::kOpen, std::memory_order_relaxed);
  thread_ = std::thread([this] { run(); });
}

void BusBackend::close() noexcept {
  {
    const std::lock_guard lock(mutex_);
    end_ = true;
  }
  wake_.notify_all();
  if (thread_.joinable()) thread_.join();
  health_.store(BackendHealth::kClosed, std::memory_order_relaxed);
}

ServoFeedback BusBackend::read() noexcept {
  ServoFeedback feedback;
  if (!settings_.readback || health() != BackendHealth::kOpen || !feedback_.load(feedback)) return {};
  return feedback;
}

std::string BusBackend::take_news() {
  const std::lock_guard lock(mutex_);
  return std::exchange(news_, {});
}

void BusBackend::tell(const std::string& news) {
  const std::lock_guard lock(mutex_);
  news_ += (news_.empty() ? "" : "\n") + news;
}

bool BusBackend::pause(std::int64_t nanoseconds) {
  std::unique_lock lock(mutex_);
  return !wake_.wait_for(lock, std::chrono::nanoseconds(nanoseconds), [&] { return end_; });
}

void BusBackend::run() noexcept {
  double reopen_s = settings_.reopen_after_s;
  bool open = true;
  for (;;) {
    try {
      if (!open) {
        tell(device_->open());
        open = true;
        exchange(true);
        // The servos come to where the cycle holds the arm; it stays in Error, and holds, until they are
        // there.
        if (pause(device_->approach_ns())) {
          cause_.store(0, std::memory_order_relaxed);
          health_.store(BackendHealth::kOpen, std::memory_order_release);
        }
      }
      serve();
      if (settings_.relax_at_end) device_->relax();
      device_->close();
      return;
    } catch (const DeviceError& error) {
      device_->close();
      // The first cause is told, not that the device is not there while it is being tried again.
      if (health_.load(std::memory_order_relaxed) != BackendHealth::kLost) {
        cause_.store(static_cast<std::uint32_t>(error.cause()), std::memory_order_relaxed);
        health_.store(BackendHealth::kLost, std::memory_order_release);  // whoever sees it sees its cause
        tell(std::string("lost: ") + error.what() + "; trying again");
        reopen_s = settings_.reopen_after_s;
      }
      open = false;
    }
    if (!pause(static_cast<std::int64_t>(reopen_s * 1e9))) return;
    reopen_s = std::min(2.0 * reopen_s, kSlowestReopen * settings_.reopen_after_s);
  }
}

void BusBackend::serve() {
  auto due = Clock::now();
  for (;;) {
    exchange(false);
    due = std::max(due + std::chrono::nanoseconds(device_->period_ns()), Clock::now());
    if (!pause((due - Clock::now()).count())) return;
  }
}

void BusBackend::exchange(bool approach) {
  ServoFrame frame;
  if (!newest_.load(frame)) return;  // torn by a writer that never rests: the next one
  device_->send(frame, approach);
  if (!settings_.readback) return;
  std::array<double, kMaxServos> pulse_us{};
  ServoFeedback feedback;
  if (approach) {  // what was measured before is old, and what could be measured now will be by then
    feedback_.store(feedback);
    return;
  }
  feedback.measured = device_->measure(frame, pulse_us);
  for (std::size_t i = 0; feedback.measured && i < arm_.dof; ++i) {
    const ServoMap& map = arm_.servos[i];
    feedback.position_rad[i] = (pulse_us[i] - map.zero_us) / (map.direction * map.us_per_rad);
  }
  feedback_.store(feedback);
}

}  // namespace corbot::rt
