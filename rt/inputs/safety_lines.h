// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "corbot/backend/emergency_stop.h"
#include "corbot/backend/log_line.h"
#include "corbot/backend/still_watch.h"
#include "rt/backends/gpio/gpio_lines.h"
#include "rt/inputs/cycle_view.h"
#include "rt/inputs/output_line.h"
#include "rt/inputs/stop_logic.h"
#include "rt/inputs/watchdog_output.h"

namespace corbot::rt {

struct SafetySettings {
  std::optional<GpioRequest> stop;      ///< the input of an emergency stop
  std::optional<GpioRequest> power;     ///< the output that enables the servos' power
  std::optional<GpioRequest> watchdog;  ///< the output that toggles in normal operation
  std::int64_t watchdog_period_ns{10'000'000};
  bool off_at_stop{true};
  int category{1};                      ///< of a stop, as in IEC 60204-1: 0 or 1
  std::int64_t ramp_ns{1'000'000'000};  ///< longest time from a press to power off
  int priority{0};                      ///< SCHED_FIFO, if permitted; 0: an ordinary thread
};

/// Serves the emergency stop input, the servos' power and the watchdog output in one thread, for any backend.
/// A press reaches EmergencyStop by the line's edge, or at the latest when the level is next read, kLook_ns
/// later. A chip that goes away counts as a press, and is tried again, as is a switch that failed.
/// Power is off before allow_power() and after stop(). If so configured, it is also off from a stop of any
/// source (see PowerLogic), or from a start in Error, until a Clear.
/// Each look ends with EmergencyStop::beat(). If a call to a chip blocks, the beat is missing, and the cycle
/// notices that. If the cycle and the thread that serves the device both stand still, nothing can slow the
/// arm down or de-energise the drives. This counts as a press, and the power goes off at once.
class SafetyLines {
 public:
  static constexpr std::int64_t kLook_ns = 2'000'000;
  static constexpr std::size_t kMaxLogLines = 256;  ///< greatest number of lines waiting to be drained

  /// The thread calls `view`.
  SafetyLines(SafetySettings settings, std::unique_ptr<GpioChips> chips, EmergencyStop& emergency_stop,
              std::function<CycleView()> view);
  SafetyLines(const SafetyLines&) = delete;
  SafetyLines& operator=(const SafetyLines&) = delete;
  ~SafetyLines() { stop(); }

  /// Requests the lines and starts the watch. When it returns, the thread's first look is over. Otherwise
  /// this counts as a press (StopSource::kWatcher), so that nothing is energised. Throws DeviceError.
  void start();
  /// Switches the power off and releases the lines. May be called twice.
  void stop() noexcept;
  /// Reports that the device is open, and sends pulses.
  void allow_power() noexcept { is_open_.store(true, std::memory_order_release); }
  /// Returns the log lines since the last call, for another thread to print: a terminal may block its writer.
  /// If nothing drains the log, later lines are dropped.
  [[nodiscard]] std::vector<LogLine> drain_log();

 private:
  enum class Input { kGood, kActive, kUnheard };

  void run() noexcept;
  /// Waits for an edge, or a while.
  [[nodiscard]] Input look();
  [[nodiscard]] Input look_or_lose() noexcept;
  void reopen() noexcept;
  void step(Input input) noexcept;
  /// Reports a press and its source: a measured press and an assumed one are distinguished.
  void set_stop(Input input, std::int64_t now_ns) noexcept;
  void switch_outputs(std::int64_t now_ns) noexcept;
  void await_first_look();
  /// Neither the cycle nor the device's thread advances.
  [[nodiscard]] bool is_all_still(std::int64_t now_ns, const CycleView& view) noexcept;
  void log(std::string text);

  const SafetySettings settings_;
  const std::unique_ptr<GpioChips> chips_;
  EmergencyStop& emergency_stop_;
  const std::function<CycleView()> view_;

  StopLogic stop_logic_;
  PowerLogic power_logic_;
  std::unique_ptr<GpioInput> input_;
  std::optional<PowerSwitch> power_;
  std::optional<WatchdogOutput> watchdog_;
  StillWatch cycle_{StillWatch::kDevice_ns};
  StillWatch device_{StillWatch::kDevice_ns};
  std::uint32_t newest_cycle_{0};
  std::int64_t looked_at_ns_{0};
  std::int64_t reopen_at_ns_{0};
  bool was_active_{false};   ///< since the press began
  bool was_unheard_{false};  ///< since the press began
  bool was_pressed_{false};
  std::atomic<bool> is_open_{false};
  std::atomic<bool> end_{false};
  std::atomic<bool> has_looked_{false};  ///< set by the thread
  std::mutex mutex_;
  std::vector<LogLine> log_;
  std::thread thread_;
};

}  // namespace corbot::rt
