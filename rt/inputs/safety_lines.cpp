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
constexpr std::size_t kMostNews = 4096;  // bytes that nobody has taken
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

std::string SafetyLines::take_news() {
  const std::lock_guard lock(mutex_);
  return std::exchange(news_, {});
}

void SafetyLines::tell(const std::string& news) {
  const std::lock_guard lock(mutex_);
  if (news_.size() < kMostNews) news_ += (news_.empty() ? "" : "\n") + news;
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
    if (!lost.empty()) tell("emergency stop taken for pressed: " + lost + "; trying again");
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
    tell("emergency stop: its line is back");
  } catch (const DeviceError&) {
    reopen_at_ns_ = now_ns() + kReopenAfter_ns;
  }
}

/// First what stops the arm, then the words.
void SafetyLines::step(bool is_bad) noexcept {
  const bool pressed = settings_.stop && stop_logic_.step(is_bad, now_ns());
  if (settings_.stop) emergency_stop_.set(StopSource::kGpio, pressed);
  if (settings_.power) switch_power();
  if (pressed != was_pressed_) tell(pressed ? "emergency stop pressed" : "emergency stop released");
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
    tell(may ? "servo power on" : "servo power off");
    return;
  }
  if (power_error_ == 0) {
    ask_again_at_ns_ = now_ns() + kReopenAfter_ns;
    tell(std::string("servo power cannot be switched ") + (may ? "on: " : "OFF: ") + std::strerror(error) +
         "; trying again");
  }
  power_error_ = error;
  ask_for_output_again();
}

/// A chip that was gone knows nothing of the old request.
void SafetyLines::ask_for_output_again() noexcept {
  if (now_ns() < ask_again_at_ns_) return;
  ask_again_at_ns_ = now_ns() + kReopenAfter_ns;
  output_.reset();  // who has a line cannot ask for it
  try {
    output_ = chips_->outputs(*settings_.power);
    if (is_powered_) tell("servo power off: its line is back");
    is_powered_ = false;
    power_error_ = 0;
  } catch (const DeviceError&) {
  }
}

void SafetyLines::switch_off_at_end() noexcept {
  int error = output_ ? output_->set(0) : is_powered_ ? ENODEV : 0;
  for (int i = 1; error != 0 && i < kTriesAtEnd; ++i) {
    std::this_thread::sleep_for(std::chrono::nanoseconds(kLook_ns));
    ask_again_at_ns_ = 0;
    if (i == kTriesAtEnd / 2) ask_for_output_again();
    error = output_ ? output_->set(0) : ENODEV;
  }
  if (error != 0) tell(std::string("SERVO POWER COULD NOT BE SWITCHED OFF: ") + std::strerror(error));
  is_powered_ = false;
}

}  // namespace corbot::rt
