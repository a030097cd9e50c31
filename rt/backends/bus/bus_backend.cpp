// SPDX-License-Identifier: Apache-2.0
#include "rt/backends/bus/bus_backend.h"

#include <algorithm>
#include <optional>
#include <utility>

#include "rt/backends/bus/bus_reading.h"
#include "rt/backends/bus/step_limit.h"
#include "rt/backends/bus/stop_input.h"
#include "rt/backends/bus/tenths.h"
#include "rt/threads/thread_priority.h"

namespace corbot::rt {
namespace {

using Clock = std::chrono::steady_clock;

constexpr double kSlowestReopen = 10.0;  // times the first pause
constexpr int kToleratedMisses = 2;
constexpr int kRecoveryCount = 25;
/// A device that was open for this long is tried again soon; one that fails sooner, at growing intervals.
constexpr auto kStableAfter = std::chrono::seconds(5);

constexpr auto kBeat = std::chrono::milliseconds(5);

Clock::duration seconds(double value) {
  return std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(value));
}

}  // namespace

BusBackend::BusBackend(const ArmModel& arm, std::unique_ptr<BusDevice> device, BusSettings settings,
                       EmergencyStop& stop)
    : arm_(arm),
      device_(std::move(device)),
      settings_(std::move(settings)),
      stop_(stop),
      newest_(frames_),
      sender_(*device_),
      stop_state_(stop, seconds(settings_.ramp_s)),
      approach_(
          arm_, *device_, sender_, newest_, std::chrono::milliseconds(settings_.stagger_ms),
          [this](const ServoFrame& newest) { return is_stopped(newest); },
          [this](const BusReading& reading) { publish(reading); },
          [this](auto due) { return pause_until(due); }) {}

BusBackend::Phase BusBackend::approach() {
  feedback_.store(ServoFeedback{});  // earlier measurements are old
  sender_.reset_longest_age();
  is_power_off_done_ = false;
  const auto is_stopped_now = [this] {
    end_cancelled_start();
    return is_stopped(newest_.read());
  };
  if (!is_energised_ && !device_->energise(is_stopped_now)) return Phase::kStandby;
  is_energised_ = true;
  switch (approach_.run(is_starting_ ? std::optional(found_) : std::nullopt)) {
    case Approach::Outcome::kThere:
      break;
    case Approach::Outcome::kStopped:
      is_energised_ = !device_->de_energise();  // without set-points nothing would be held by them
      return Phase::kStandby;
    case Approach::Outcome::kEnd:
      return Phase::kEnd;
  }
  open_since_ = Clock::now();
  standstill_.begin(open_since_, newest_.read().cycle);
  cause_.store(DeviceCause::kNone, std::memory_order_relaxed);
  health_.store(BackendHealth::kOpen, std::memory_order_release);
  return Phase::kServe;
}

bool BusBackend::is_stopped(const ServoFrame& newest) {
  beats_.fetch_add(1, std::memory_order_relaxed);  // orders nothing, as below
  read_stop_input(*device_, stop_);
  stop_state_.look(newest, Clock::now());
  return stop_state_.is_stopped();
}

void BusBackend::publish(const BusReading& reading) {
  feedback_.store(feedback_of(arm_, reading, Clock::now().time_since_epoch().count()));
}

/// Sends the last commands to an open device.
void BusBackend::leave(bool is_proper_end) noexcept {
  try {
    if (settings_.relax_at_end) device_->relax();
  } catch (const DeviceError& error) {
    log(std::string("could not be relaxed: ") + error.what());
    is_proper_end = false;
  }
  if (is_proper_end) {
    device_->close();
  } else {
    device_->close_after_fault();
  }
  is_energised_ = false;
  log(device_->drain_log());
}

void BusBackend::close() noexcept {
  {
    const std::lock_guard lock(mutex_);
    end_ = true;
  }
  wake_.notify_all();
  if (thread_.joinable()) {
    thread_.join();
  } else if (is_connected_) {
    leave(true);
  }
  is_connected_ = false;
  health_.store(BackendHealth::kClosed, std::memory_order_relaxed);
}

ServoFeedback BusBackend::read() noexcept {
  ServoFeedback feedback;
  const BackendHealth now = health();
  const bool is_open = now == BackendHealth::kOpen || now == BackendHealth::kDegraded;
  const bool is_asked = now == BackendHealth::kStandby || (is_open && is_read_back());
  if (!is_asked || !feedback_.load(feedback)) return {};
  return feedback;
}

std::vector<LogLine> BusBackend::drain_log() {
  const std::lock_guard lock(mutex_);
  return std::exchange(log_, {});
}

void BusBackend::log(std::string text, LogLine::Kind kind) {
  if (text.empty()) return;
  const std::lock_guard lock(mutex_);
  log_.push_back({kind, std::move(text)});
}

bool BusBackend::pause_until(Clock::time_point due) {
  std::unique_lock lock(mutex_);
  do {
    beats_.fetch_add(1, std::memory_order_relaxed);  // orders nothing: it shows that this thread runs
  } while (!wake_.wait_until(lock, std::min(due, Clock::now() + kBeat), [&] { return end_; }) &&
           Clock::now() < due);
  const bool goes_on = !end_;
  end_cancelled_start();
  return goes_on;
}

void BusBackend::run_from(Phase phase) noexcept {
  if (settings_.priority > 0) (void)set_fifo_priority(settings_.priority);  // best effort
  double reopen_s = settings_.reopen_after_s;
  for (;;) {
    try {
      while (phase != Phase::kEnd) phase = run(phase);
      leave(true);
      return;
    } catch (const DeviceError& error) {
      if (lose(error)) reopen_s = settings_.reopen_after_s;
      phase = Phase::kReopen;
    }
    if (!pause_until(Clock::now() + seconds(reopen_s))) return;
    reopen_s = std::min(2.0 * reopen_s, kSlowestReopen * settings_.reopen_after_s);
  }
}

BusBackend::Phase BusBackend::run(Phase phase) {
  switch (phase) {
    case Phase::kReopen:
      log(device_->open());
      return Phase::kStandby;
    case Phase::kStandby:
      return stand_by();
    case Phase::kApproach:
      return approach();
    case Phase::kServe:
      return serve();
    case Phase::kEnd:
      break;
  }
  return Phase::kEnd;
}

bool BusBackend::lose(const DeviceError& error) {
  lose_stop_input(*device_, stop_);
  feedback_.store(ServoFeedback{});
  // The first cause is reported, not that the device is absent while it is being tried again.
  const bool is_new = health() != BackendHealth::kLost;
  if (is_new) {
    cause_.store(error.cause(), std::memory_order_relaxed);
    log(error.what(), LogLine::Kind::kLost);
    // Publishes the loss after its cause and its log line.
    health_.store(BackendHealth::kLost, std::memory_order_release);
  }
  // Closes the device after that: drives take up to a second for their quick stop, and the cycle must not
  // wait for it.
  device_->close_after_fault();
  is_energised_ = is_power_off_done_ = false;
  if (!is_new) return false;
  stop_state_.device_lost();
  return Clock::now() - std::exchange(open_since_, Clock::now()) > kStableAfter;
}

/// The device is present, or back, and watched. It counts as lost until the cycle has answered the loss; from
/// then on the cycle decides by its frames.
BusBackend::Phase BusBackend::stand_by() {
  misses_ = 0;
  std::optional<BusReading> before;
  for (auto due = Clock::now();;) {
    try {
      approach_.halt_left_over();
      const ServoFrame& newest = newest_.read();
      const BusReading reading = refined(device_->measure(newest), sender_.last());
      const bool is_second = before.has_value();
      const bool is_plausible = is_second && may_be_pulses_of(arm_, *before, reading);
      const bool is_measured = reading.unit == BusReading::Unit::kJoints;
      publish(is_measured || is_plausible ? reading : BusReading{});
      before = reading;
      const bool stopped = is_stopped(newest);
      (void)switch_off_where_due();
      if (is_second && stop_state_.is_answered())
        health_.store(BackendHealth::kStandby, std::memory_order_release);
      if (!stopped) return Phase::kApproach;
      misses_ = 0;
      log(device_->drain_log());
    } catch (const DeviceError& error) {
      feedback_.store(ServoFeedback{});
      before.reset();
      if (!is_noise(error.cause()) || ++misses_ > kToleratedMisses) throw DeviceError(error);
    }
    due = std::max(due + std::chrono::nanoseconds(device_->period_ns()), Clock::now());
    if (!pause_until(due)) return Phase::kEnd;
  }
}

bool BusBackend::switch_off_where_due() {
  if (!stop_state_.is_power_off_due()) {
    is_power_off_done_ = false;
    return false;
  }
  if (is_power_off_done_) return !is_energised_;
  const bool is_off = device_->de_energise();
  is_power_off_done_ = true;
  if (is_off) is_energised_ = false;
  return is_off;
}

BusBackend::Phase BusBackend::serve() {
  misses_ = 0;
  good_ = 0;
  rate_.begin(device_->period_ns());
  sender_.set_speed_ratio(rate_.speed_ratio());
  auto due = Clock::now();
  for (;;) {
    const auto begin = Clock::now();
    try {
      exchange();
      if (switch_off_where_due()) {
        health_.store(BackendHealth::kStandby, std::memory_order_release);
        return Phase::kStandby;
      }
      log(device_->drain_log());
      const bool has_answered = device_->has_answered();
      if (has_answered) misses_ = 0;
      if (const auto warning = device_->warning()) degrade(*warning);
      if (has_answered && ++good_ == kRecoveryCount && health() == BackendHealth::kDegraded) {
        cause_.store(DeviceCause::kNone, std::memory_order_relaxed);
        log("answers again");
        health_.store(BackendHealth::kOpen, std::memory_order_release);
      }
    } catch (const DeviceError& error) {
      tolerate(error);
    }
    count_frame(Clock::now() - begin);
    due = std::max(next_due(due), Clock::now());
    if (!pause_until(due)) return Phase::kEnd;
  }
}

void BusBackend::count_frame(Clock::duration busy) {
  const bool was_slow = rate_.is_slow();
  const bool is_known_anew = rate_.count(std::chrono::nanoseconds(busy).count());
  if (rate_.is_slow()) good_ = 0;  // regardless of its answers
  if (!is_known_anew) return;
  sender_.set_speed_ratio(rate_.speed_ratio());
  if (!rate_.is_slow() && !was_slow) return;
  const std::string rates = settings_.name + ": takes " + tenths(rate_.reached_hz()) +
                            " frames a second, but announced " + tenths(rate_.announced_hz());
  if (!rate_.is_slow()) return log(rates + "; the arm moves at full speed again");
  degrade(DeviceError(DeviceCause::kTooSlow, rates + "; the arm moves slower in the same ratio"));
}

Clock::time_point BusBackend::next_due(Clock::time_point last) const {
  const auto due = last + std::chrono::nanoseconds(device_->period_ns());
  const auto phase_ns = device_->phase_ns();
  if (!phase_ns || sender_.last().time_ns == 0 || arm_.period_ns <= 0) return due;
  // Takes the nearest instant at that phase of the loop's cycle.
  const std::int64_t late_ns =
      (due.time_since_epoch().count() - sender_.last().time_ns - *phase_ns) % arm_.period_ns;
  const std::int64_t half_ns = arm_.period_ns / 2;
  const std::int64_t wrapped_ns = late_ns > half_ns    ? late_ns - arm_.period_ns
                                  : late_ns < -half_ns ? late_ns + arm_.period_ns
                                                       : late_ns;
  return due - std::chrono::nanoseconds(wrapped_ns);
}

void BusBackend::tolerate(const DeviceError& error) {
  feedback_.store(ServoFeedback{});
  if (!is_noise(error.cause()) || ++misses_ > kToleratedMisses) throw DeviceError(error);
  degrade(error);
}

void BusBackend::degrade(const DeviceError& error) {
  good_ = 0;
  if (health() == BackendHealth::kDegraded) return;
  cause_.store(error.cause(), std::memory_order_relaxed);
  log(error.what(), LogLine::Kind::kDegraded);
  health_.store(BackendHealth::kDegraded, std::memory_order_release);
}

void BusBackend::exchange() {
  ServoFrame frame = newest_.read();
  if (const auto still_ns = standstill_.look(Clock::now(), frame.cycle, arm_.period_ns)) {
    throw DeviceError(DeviceCause::kThreadStill, settings_.name + ": its thread stood still for " +
                                                     tenths(static_cast<double>(*still_ns) * 1e-9) + " s");
  }
  const double period_s = static_cast<double>(device_->period_ns()) * 1e-9;
  const double gap_s = static_cast<double>(device_->longest_gap_ns()) * 1e-9;
  if (limit_step(arm_, sender_.last(), period_s, period_s + gap_s, frame)) {
    sender_.send(frame);
  } else {
    sender_.send_on_the_way(frame, false);
  }
  (void)is_stopped(frame);
  if (is_read_back()) publish(device_->measure(frame));
}

}  // namespace corbot::rt
