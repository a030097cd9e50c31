// SPDX-License-Identifier: Apache-2.0
#include "rt/inputs/safety_lines.h"

#include <algorithm>
#include <chrono>
#include <utility>

#include "corbot/running_time.h"
#include "rt/backends/bus/device_error.h"
#include "rt/threads/thread_priority.h"

namespace corbot::rt {
namespace {

constexpr std::int64_t kReopenAfter_ns = 200'000'000;
constexpr std::int64_t kLongestLook_ns = 20'000'000;  // upper limit of the counted time between two looks
constexpr std::chrono::seconds kFirstLookWithin{2};

std::int64_t now_ns() { return std::chrono::steady_clock::now().time_since_epoch().count(); }

}  // namespace

SafetyLines::SafetyLines(SafetySettings settings, std::unique_ptr<GpioChips> chips,
                         EmergencyStop& emergency_stop, std::function<CycleView()> view)
    : settings_(std::move(settings)),
      chips_(std::move(chips)),
      emergency_stop_(emergency_stop),
      view_(std::move(view)),
      power_logic_(settings_.category, settings_.ramp_ns) {
  const auto log_text = [this](std::string text) { log(std::move(text)); };
  if (settings_.power) power_.emplace(*chips_, *settings_.power, log_text);
  if (settings_.watchdog)
    watchdog_.emplace(*chips_, *settings_.watchdog, settings_.watchdog_period_ns, log_text);
}

void SafetyLines::start() {
  if (power_) power_->open();
  if (watchdog_) watchdog_->open();
  if (view_().in_error) power_logic_.latch();
  if (settings_.stop) {
    input_ = chips_->input(*settings_.stop);
    step(look());
  }
  if (!power_ && !watchdog_ && !settings_.stop) return;
  emergency_stop_.beat();  // from now on beats are required
  thread_ = std::thread([this] { run(); });
  await_first_look();
}

void SafetyLines::await_first_look() {
  Patience patience{kFirstLookWithin};
  while (!has_looked_.load(std::memory_order_acquire)) {
    if (patience.is_over()) {
      emergency_stop_.set(StopSource::kWatcher, true);
      return log(
          "the thread that watches the lines has not read them in time: the emergency stop counts as "
          "pressed");
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
}

void SafetyLines::stop() noexcept {
  end_.store(true, std::memory_order_release);
  if (thread_.joinable()) thread_.join();
  if (watchdog_) watchdog_->end();
  if (power_) power_->end();
  watchdog_.reset();
  power_.reset();
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
    step(look_or_lose());
    emergency_stop_.beat();
    has_looked_.store(true, std::memory_order_release);
  }
}

SafetyLines::Input SafetyLines::look_or_lose() noexcept {
  try {
    return look();
  } catch (const std::exception& error) {
    input_.reset();
    reopen_at_ns_ = now_ns() + kReopenAfter_ns;
    step(Input::kUnheard);  // first stop the arm, then log
    log(std::string("emergency stop assumed pressed: ") + error.what() + "; trying again");
    return Input::kUnheard;
  }
}

SafetyLines::Input SafetyLines::look() {
  const std::chrono::nanoseconds longest{watchdog_ ? watchdog_->wait_ns(now_ns(), kLook_ns) : kLook_ns};
  if (!settings_.stop) {
    std::this_thread::sleep_for(longest);
    return Input::kGood;
  }
  if (!input_) {
    std::this_thread::sleep_for(longest);
    reopen();
    return Input::kUnheard;
  }
  const bool was_edge = input_->wait_edge(longest);
  return input_->is_active() || was_edge ? Input::kActive : Input::kGood;
}

void SafetyLines::reopen() noexcept {
  if (now_ns() < reopen_at_ns_) return;
  try {
    input_ = chips_->input(*settings_.stop);
    log("emergency stop: its line can be read again");
  } catch (const std::exception&) {
    reopen_at_ns_ = now_ns() + kReopenAfter_ns;
  }
}

/// Stops the arm first, then logs.
void SafetyLines::step(Input input) noexcept {
  const std::int64_t now = now_ns();
  set_stop(input, now);
  switch_outputs(now);
  if (stop_logic_.pressed() == was_pressed_ || !settings_.stop) return;
  was_pressed_ = stop_logic_.pressed();
  log(was_pressed_ ? "emergency stop pressed" : "emergency stop released");
}

void SafetyLines::set_stop(Input input, std::int64_t now) noexcept {
  if (!settings_.stop) {
    emergency_stop_.set(StopSource::kGpioUnheard, power_ && power_->is_lost());
    return;
  }
  was_active_ |= input == Input::kActive;
  was_unheard_ |= input == Input::kUnheard;
  if (!stop_logic_.step(input != Input::kGood, now)) was_active_ = was_unheard_ = false;
  emergency_stop_.set(StopSource::kGpio, was_active_);
  emergency_stop_.set(StopSource::kGpioUnheard, was_unheard_ || (power_ && power_->is_lost()));
}

void SafetyLines::switch_outputs(std::int64_t now) noexcept {
  if (!power_ && !watchdog_) return;
  const bool is_open = is_open_.load(std::memory_order_acquire);
  const auto [sources, presses] = emergency_stop_.state();  // before the view: see PowerLogic
  const CycleView view = view_();
  const bool is_still = is_all_still(now, view);
  if (is_still) {
    emergency_stop_.set(StopSource::kDeviceUnheard, true);  // until its thread reads the input again
    power_logic_.latch();
  }
  bool may = power_logic_.step(now, sources != 0 || is_still, presses, view);
  if (watchdog_) {
    // If the power is to stay on at a stop, only a standstill takes it off.
    watchdog_->step(now, is_open && (may || (!settings_.off_at_stop && watchdog_->is_running())), view);
    const bool is_tripped = watchdog_->is_tripped();
    emergency_stop_.set(StopSource::kWatchdog, is_tripped);
    if (is_tripped) power_logic_.latch();  // nothing is left that could slow the arm down
    may = may && !is_tripped;
  }
  if (power_) power_->set(is_open && (may || (!settings_.off_at_stop && power_->is_on())), now);
}

bool SafetyLines::is_all_still(std::int64_t now, const CycleView& view) noexcept {
  const std::int64_t ran_ns = looked_at_ns_ == 0 ? 0 : std::min(now - looked_at_ns_, kLongestLook_ns);
  looked_at_ns_ = now;
  if (view.is_known) newest_cycle_ = static_cast<std::uint32_t>(view.cycle);
  const bool is_cycle_still = cycle_.look(newest_cycle_, ran_ns);
  return device_.look(view.bus_beats, ran_ns) && is_cycle_still;
}

}  // namespace corbot::rt
