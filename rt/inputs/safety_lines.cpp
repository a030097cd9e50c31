// SPDX-License-Identifier: Apache-2.0
#include "rt/inputs/safety_lines.h"

#include <pthread.h>
#include <sched.h>

#include <chrono>
#include <cstring>
#include <utility>

#include "rt/backends/serial_port.h"

namespace corbot::rt {
namespace {

constexpr std::int64_t kReopenAfter_ns = 200'000'000;

std::int64_t now_ns() { return std::chrono::steady_clock::now().time_since_epoch().count(); }

}  // namespace

SafetyLines::SafetyLines(SafetySettings settings, std::unique_ptr<GpioChips> chips,
                         EmergencyStop& emergency_stop, std::function<CycleView()> view,
                         std::function<void(const std::string&)> tell)
    : settings_(std::move(settings)),
      chips_(std::move(chips)),
      emergency_stop_(emergency_stop),
      view_(std::move(view)),
      tell_(std::move(tell)),
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
  if (output_) (void)output_->set(0);
  output_.reset();
  input_.reset();
}

void SafetyLines::run() noexcept {
  if (settings_.priority > 0) {
    sched_param parameters{};
    parameters.sched_priority = settings_.priority;
    (void)::pthread_setschedparam(::pthread_self(), SCHED_FIFO, &parameters);  // else as good as it goes
  }
  while (!end_.load(std::memory_order_acquire)) {
    bool is_bad = true;
    try {
      is_bad = look();
    } catch (const DeviceError& error) {
      input_.reset();
      reopen_at_ns_ = now_ns() + kReopenAfter_ns;
      tell_(std::string("emergency stop taken for pressed: ") + error.what() + "; trying again");
    }
    step(is_bad);
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
    tell_("emergency stop: its line is back");
  } catch (const DeviceError&) {
    reopen_at_ns_ = now_ns() + kReopenAfter_ns;
  }
}

void SafetyLines::step(bool is_bad) noexcept {
  if (settings_.stop) {
    const bool pressed = stop_logic_.step(is_bad, now_ns());
    emergency_stop_.set(StopSource::kGpio, pressed);
    if (pressed != was_pressed_) tell_(pressed ? "emergency stop pressed" : "emergency stop released");
    was_pressed_ = pressed;
  }
  if (!output_) return;
  const CycleView view = view_();
  const bool may = power_logic_.step(is_open_.load(std::memory_order_acquire), emergency_stop_.sources() != 0,
                                     emergency_stop_.presses(), view.cycle, view.in_error);
  if (may == is_powered_) return;
  is_powered_ = may;
  const int error = output_->set(may ? 1 : 0);
  if (error != 0) tell_(std::string("power enable: ") + std::strerror(error));
  tell_(may ? "servo power on" : "servo power off");
}

}  // namespace corbot::rt
