// SPDX-License-Identifier: Apache-2.0
#include "rt/inputs/safety_lines.h"

#include <cerrno>
#include <chrono>
#include <cstring>
#include <utility>

#include "rt/backends/bus/device_error.h"
#include "rt/threads/thread_priority.h"

namespace corbot::rt {
namespace {

constexpr std::int64_t kReopenAfter_ns = 200'000'000;
constexpr int kTriesAtEnd = 10;

std::int64_t now_ns() { return std::chrono::steady_clock::now().time_since_epoch().count(); }

}  // namespace

SafetyLines::SafetyLines(SafetySettings settings, std::unique_ptr<GpioChips> chips,
                         EmergencyStop& emergency_stop, std::function<CycleView()> view)
    : settings_(std::move(settings)),
      chips_(std::move(chips)),
      emergency_stop_(emergency_stop),
      view_(std::move(view)),
      power_logic_(settings_.off_at_stop) {}

void SafetyLines::start() {
  if (settings_.power) output_ = chips_->outputs(*settings_.power);
  if (view_().in_error) power_logic_.latch();
  if (settings_.stop) {
    input_ = chips_->input(*settings_.stop);
    step(look());
  }
  if (!settings_.power && !settings_.stop) return;
  thread_ = std::thread([this] { run(); });
}

void SafetyLines::stop() noexcept {
  end_.store(true, std::memory_order_release);
  if (thread_.joinable()) thread_.join();
  switch_off_at_end();
  output_.reset();
  input_.reset();
}

std::vector<LogLine> SafetyLines::drain_log() {
  const std::lock_guard lock(mutex_);
  return std::exchange(log_, {});
}

void SafetyLines::log(std::string text) {
  const std::lock_guard lock(mutex_);
  if (log_.size() < kMaxLogLines) log_.push_back({LogLine::Kind::kWarning, std::move(text)});
}

void SafetyLines::run() noexcept {
  if (settings_.priority > 0) (void)set_fifo_priority(settings_.priority);  // best effort
  while (!end_.load(std::memory_order_acquire)) {
    bool is_bad = true;
    std::string lost;
    try {
      is_bad = look();
    } catch (const DeviceError& error) {
      input_.reset();
      reopen_at_ns_ = now_ns() + kReopenAfter_ns;
      lost = error.what();
    }
    step(is_bad);
    if (!lost.empty()) log("emergency stop assumed pressed: " + lost + "; trying again");
  }
}

bool SafetyLines::look() {
  const std::chrono::nanoseconds longest{kLook_ns};
  if (!settings_.stop) {
    std::this_thread::sleep_for(longest);
    return false;
  }
  if (!input_) {
    std::this_thread::sleep_for(longest);
    reopen();
    return true;
  }
  const bool was_edge = input_->wait_edge(longest);
  return input_->is_active() || was_edge;
}

void SafetyLines::reopen() noexcept {
  if (now_ns() < reopen_at_ns_) return;
  try {
    input_ = chips_->input(*settings_.stop);
    log("emergency stop: its line is back");
  } catch (const DeviceError&) {
    reopen_at_ns_ = now_ns() + kReopenAfter_ns;
  }
}

/// First what stops the arm, then the log.
void SafetyLines::step(bool is_bad) noexcept {
  const bool pressed = settings_.stop && stop_logic_.step(is_bad, now_ns());
  if (settings_.stop) emergency_stop_.set(StopSource::kGpio, pressed);
  if (settings_.power) switch_power();
  if (pressed != was_pressed_) log(pressed ? "emergency stop pressed" : "emergency stop released");
  was_pressed_ = pressed;
}

void SafetyLines::switch_power() noexcept {
  const CycleView view = view_();
  const bool may = power_logic_.step(is_open_.load(std::memory_order_acquire), emergency_stop_.sources() != 0,
                                     emergency_stop_.presses(), view.cycle, view.in_error);
  if (may == is_powered_) return;
  const int error = output_ ? output_->set(may ? 1 : 0) : ENODEV;
  if (error == 0) {
    is_powered_ = may;
    power_error_ = 0;
    log(may ? "servo power on" : "servo power off");
    return;
  }
  if (power_error_ == 0) {
    retry_at_ns_ = now_ns() + kReopenAfter_ns;
    log(std::string("servo power cannot be switched ") + (may ? "on: " : "OFF: ") + std::strerror(error) +
        "; trying again");
  }
  power_error_ = error;
  request_output_again();
}

/// A chip that was gone has forgotten the old request.
void SafetyLines::request_output_again() noexcept {
  if (now_ns() < retry_at_ns_) return;
  retry_at_ns_ = now_ns() + kReopenAfter_ns;
  output_.reset();  // a line that is held cannot be requested
  try {
    output_ = chips_->outputs(*settings_.power);
    if (is_powered_) log("servo power off: its line is back");
    is_powered_ = false;
    power_error_ = 0;
  } catch (const DeviceError&) {
  }
}

void SafetyLines::switch_off_at_end() noexcept {
  int error = output_ ? output_->set(0) : is_powered_ ? ENODEV : 0;
  for (int i = 1; error != 0 && i < kTriesAtEnd; ++i) {
    std::this_thread::sleep_for(std::chrono::nanoseconds(kLook_ns));
    retry_at_ns_ = 0;
    if (i == kTriesAtEnd / 2) request_output_again();
    error = output_ ? output_->set(0) : ENODEV;
  }
  if (error != 0) log(std::string("SERVO POWER COULD NOT BE SWITCHED OFF: ") + std::strerror(error));
  is_powered_ = false;
}

}  // namespace corbot::rt
