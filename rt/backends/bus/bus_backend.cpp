// SPDX-License-Identifier: Apache-2.0
#include "rt/backends/bus/bus_backend.h"

#include <algorithm>
#include <utility>

#include "rt/backends/bus/step_limit.h"
#include "rt/threads/thread_priority.h"

namespace corbot::rt {
namespace {

using Clock = std::chrono::steady_clock;

constexpr double kSlowestReopen = 10.0;  // times the first pause
constexpr int kToleratedMisses = 2;
constexpr int kRecoveryCount = 25;
/// A device that was open for so long is tried again soon; one that fails sooner, more and more rarely.
constexpr auto kStableAfter = std::chrono::seconds(5);

/// Between them, a pulse width is one that the controller sends.
constexpr double kNoPulse_us = 500.0;
constexpr double kMostPulse_us = 2550.0;

/// One answer that is missing or wrong may be noise on the line.
bool may_pass(DeviceCause cause) {
  return cause == DeviceCause::kNoAnswer || cause == DeviceCause::kBadAnswer;
}

constexpr const char* kPressed = "the emergency stop is pressed; release it, then start again";

std::int64_t now_ns() { return Clock::now().time_since_epoch().count(); }

}  // namespace

BusBackend::BusBackend(const ArmModel& arm, std::unique_ptr<BusDevice> device, BusSettings settings,
                       EmergencyStop& stop)
    : arm_(arm),
      device_(std::move(device)),
      settings_(std::move(settings)),
      stop_(stop),
      sender_(*device_),
      approach_(arm_, *device_, sender_, newest_, stop_, [this](auto due) { return pause_until(due); }) {}

DevicePosition BusBackend::connect() {
  if (device_->energises_at_open() && stop_.sources() != 0) throw DeviceError(DeviceCause::kNone, kPressed);
  log(device_->open());  // a missing device is reported at once, not by an alarm
  is_connected_ = true;
  ServoFrame frame;
  frame.servo_count = arm_.dof + 1;
  for (std::size_t i = 0; i < arm_.dof; ++i) frame.channel[i] = arm_.servos[i].channel;
  frame.channel[arm_.dof] = arm_.gripper.channel;
  BusReading reading;
  try {
    reading = device_->measure(frame);
  } catch (const DeviceError& error) {
    log(std::string("reports no position: ") + error.what());
  }
  DevicePosition position;
  position.opening = -1.0;
  if (reading.unit == BusReading::Unit::kNothing) return position;
  for (std::size_t i = 0; i < arm_.dof; ++i) position.position_rad[i] = angle_rad(i, reading);
  if (reading.unit == BusReading::Unit::kJoints) {
    position.kind = DevicePosition::Kind::kMeasured;
    return position;
  }
  // Servos without pulses may have been moved since.
  if (settings_.relax_at_end) return position;
  for (std::size_t i = 0; i <= arm_.dof; ++i) {
    // At its power-up a controller reports 0, or the least, of a servo that it has given no pulse yet.
    if (!(reading.value[i] > kNoPulse_us && reading.value[i] < kMostPulse_us)) return position;
  }
  position.kind = DevicePosition::Kind::kCommanded;
  position.opening = std::clamp(
      (reading.value[arm_.dof] - arm_.gripper.closed_us) / (arm_.gripper.open_us - arm_.gripper.closed_us),
      0.0, 1.0);
  return position;
}

double BusBackend::angle_rad(std::size_t joint, const BusReading& reading) const {
  if (reading.unit == BusReading::Unit::kJoints) return reading.value[joint];
  const ServoMap& map = arm_.servos[joint];
  return (reading.value[joint] - map.zero_us) / (map.direction * map.us_per_rad);
}

void BusBackend::open(const ServoFrame& first) {
  newest_.store(first);
  if (!is_connected_) (void)connect();
  is_starting_ = true;
  try {
    if (approach_.is_stopped(first)) throw DeviceError(DeviceCause::kNone, kPressed);
    (void)approach();
  } catch (const DeviceError&) {
    leave();
    is_connected_ = false;
    throw;
  }
  is_starting_ = false;
  open_since_ = Clock::now();
  health_.store(BackendHealth::kOpen, std::memory_order_relaxed);
  thread_ = std::thread([this] { run(); });
}

bool BusBackend::approach() {
  feedback_.store(ServoFeedback{});  // what was measured before is old
  sender_.reset_longest_age();
  return approach_.run(is_starting_);
}

/// The last commands to an open device.
void BusBackend::leave() noexcept {
  try {
    if (settings_.relax_at_end) device_->relax();
  } catch (const DeviceError& error) {
    log(std::string("could not be relaxed: ") + error.what());
  }
  device_->close();
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
    leave();
  }
  is_connected_ = false;
  health_.store(BackendHealth::kClosed, std::memory_order_relaxed);
}

ServoFeedback BusBackend::read() noexcept {
  ServoFeedback feedback;
  const BackendHealth now = health();
  const bool is_there = now == BackendHealth::kOpen || now == BackendHealth::kDegraded;
  if (!settings_.readback || !is_there || !feedback_.load(feedback)) return {};
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
  const bool goes_on = !wake_.wait_until(lock, due, [&] { return end_; });
  if (is_starting_ && is_cancelled_.load(std::memory_order_relaxed)) {
    throw DeviceError(DeviceCause::kNone, "the end was asked for before the arm was in its place");
  }
  return goes_on;
}

void BusBackend::run() noexcept {
  if (settings_.priority > 0) (void)set_fifo_priority(settings_.priority);  // best effort
  double reopen_s = settings_.reopen_after_s;
  bool open = true;
  bool is_there = true;  // else the end was asked for on the way
  for (;;) {
    try {
      if (!open) {
        if (!approach_.await_release()) return;
        log(device_->open());
        open = true;
        // The servos come to where the cycle holds the arm; it stays in Error, and holds,
        // until they are there.
        is_there = approach();
        if (is_there) {
          open_since_ = Clock::now();
          cause_.store(DeviceCause::kNone, std::memory_order_relaxed);
          health_.store(BackendHealth::kOpen, std::memory_order_release);
        }
      }
      if (is_there) serve();
      leave();
      return;
    } catch (const DeviceError& error) {
      // The first cause is reported, not that the device is not there while it is being tried again.
      if (health_.load(std::memory_order_relaxed) != BackendHealth::kLost) {
        cause_.store(error.cause(), std::memory_order_relaxed);
        log(error.what(), LogLine::Kind::kLost);
        health_.store(BackendHealth::kLost, std::memory_order_release);  // after its cause
        if (Clock::now() - open_since_ > kStableAfter) reopen_s = settings_.reopen_after_s;
      }
      device_->close();
      open = false;
    }
    const auto retry = std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(reopen_s));
    if (!pause_until(Clock::now() + retry)) return;
    reopen_s = std::min(2.0 * reopen_s, kSlowestReopen * settings_.reopen_after_s);
  }
}

void BusBackend::serve() {
  misses_ = 0;
  good_ = 0;
  auto due = Clock::now();
  for (;;) {
    try {
      exchange();
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
    due = std::max(next_due(due), Clock::now());
    if (!pause_until(due)) return;
  }
}

Clock::time_point BusBackend::next_due(Clock::time_point last) const {
  const auto due = last + std::chrono::nanoseconds(device_->period_ns());
  const auto phase_ns = device_->phase_ns();
  if (!phase_ns || sender_.last().time_ns == 0 || arm_.period_ns <= 0) return due;
  // The nearest instant at that phase of the loop's cycle.
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
  if (!may_pass(error.cause()) || ++misses_ > kToleratedMisses) throw DeviceError(error);
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
  ServoFrame frame;
  if (!newest_.load(frame)) return;  // torn by a writer that never rests: the next one
  const double period_s = static_cast<double>(device_->period_ns()) * 1e-9;
  const double gap_s = static_cast<double>(device_->longest_gap_ns()) * 1e-9;
  limit_step(arm_, sender_.last(), period_s, period_s + gap_s, frame);
  sender_.send(frame, false);
  stop_.set(StopSource::kDevice, device_->emergency_stop());
  if (!settings_.readback) return;
  const BusReading reading = device_->measure(frame);
  ServoFeedback feedback;
  feedback.measured = reading.unit != BusReading::Unit::kNothing;
  feedback.time_ns = now_ns();
  for (std::size_t i = 0; feedback.measured && i < arm_.dof; ++i) {
    feedback.position_rad[i] = angle_rad(i, reading);
  }
  feedback_.store(feedback);
}

}  // namespace corbot::rt
