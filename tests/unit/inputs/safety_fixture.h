// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <gmock/gmock.h>

#include <atomic>
#include <chrono>
#include <map>
#include <memory>
#include <string>
#include <thread>
#include <utility>

#include "rt/inputs/safety_lines.h"
#include "support/fake_gpio.h"
#include "support/wait_until.h"

namespace corbot::rt {

using test::FakeGpio;
using Clock = std::chrono::steady_clock;
using test::wait_until;

inline constexpr std::int64_t kMs = 1'000'000;
inline constexpr auto kGpio = static_cast<std::uint32_t>(StopSource::kGpio);
inline constexpr auto kGpioUnheard = static_cast<std::uint32_t>(StopSource::kGpioUnheard);
inline constexpr auto kWatcher = static_cast<std::uint32_t>(StopSource::kWatcher);
inline constexpr auto kWatchdog = static_cast<std::uint32_t>(StopSource::kWatchdog);

class SafetyLinesTest : public ::testing::Test {
 protected:
  static SafetySettings settings(bool with_stop, bool with_power) {
    SafetySettings settings;
    if (with_stop) settings.stop = GpioRequest{.chip = "stop", .lines = {"ESTOP"}, .active_low = true};
    if (with_power) settings.power = GpioRequest{.chip = "power", .lines = {"SERVO_POWER"}};
    return settings;
  }
  std::unique_ptr<SafetyLines> make(bool with_stop = true, bool with_power = true) {
    return make(settings(with_stop, with_power), gpio_.chips());
  }
  std::unique_ptr<SafetyLines> make(const SafetySettings& settings, std::unique_ptr<rt::GpioChips> chips) {
    return std::make_unique<SafetyLines>(settings, std::move(chips), stop_, [this] { return view(); });
  }
  /// A cycle that latches a stop until it is cleared, and is at rest at once.
  CycleView view() {
    if (presses_seen_.exchange(stop_.presses()) != stop_.presses()) in_error_ = true;
    if (!is_frozen_) shown_ = {.cycle = ++cycle_, .in_error = in_error_, .power_off = in_error_};
    shown_.bus_beats = bus_beats_;
    if (!is_bus_frozen_) ++bus_beats_;
    return shown_;
  }
  /// Three chips of their own.
  std::unique_ptr<rt::GpioChips> board() {
    return std::make_unique<test::FakeBoard>(
        std::map<std::string, FakeGpio*>{{"stop", &gpio_}, {"power", &power_}, {"watchdog", &watchdog_}});
  }
  /// Everything since the start.
  std::string logged(SafetyLines& lines) {
    const std::string log = to_string(lines.drain_log());
    if (!log.empty()) logged_ += log + "\n";
    return logged_;
  }
  FakeGpio gpio_;
  FakeGpio power_;
  FakeGpio watchdog_;
  EmergencyStop stop_;
  CycleView shown_{};
  std::atomic<bool> is_frozen_{false};
  std::atomic<bool> is_bus_frozen_{false};
  std::uint32_t bus_beats_{1};
  std::atomic<std::uint64_t> cycle_{0};
  std::atomic<bool> in_error_{false};
  std::atomic<std::uint32_t> presses_seen_{0};
  std::string logged_;
};

}  // namespace corbot::rt
