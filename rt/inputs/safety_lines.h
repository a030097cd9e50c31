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
  std::optional<GpioRequest> power;     ///< the output that lets the servos have power
  std::optional<GpioRequest> watchdog;  ///< the output that toggles while all is well
  std::int64_t watchdog_period_ns{10'000'000};
  bool off_at_stop{true};
  int category{1};                      ///< of a stop, as in IEC 60204-1: 0 or 1
  std::int64_t ramp_ns{1'000'000'000};  ///< the power goes at the latest this long after a press
  int priority{0};                      ///< SCHED_FIFO, where permitted; 0: an ordinary thread
};

/// The emergency stop input, the servos' power and the watchdog output, served by one thread, whatever drives the servos. A
/// press reaches EmergencyStop by the line's edge, or at the latest when its level is next looked at, kLook_ns later. A
/// chip that goes away counts as a press, and is tried again, as is a switch that failed. Power is off before
/// allow_power(), after stop(), and from a stop of any source (see PowerLogic), or from a start in Error, until it is
/// cleared, where so set. Each look ends with EmergencyStop::beat(): a call to a chip that blocks is a beat that stays
/// out, which the cycle notices. Where the cycle and the thread that serves the device both stand still, nobody is left
/// who slows the arm down or takes the drives' energy off: that is a press, and the power goes at once.
class SafetyLines {
 public:
  static constexpr std::int64_t kLook_ns = 2'000'000;
  static constexpr std::size_t kMaxLogLines = 256;  ///< that wait to be drained

  /// `view` is called by the thread.
  SafetyLines(SafetySettings settings, std::unique_ptr<GpioChips> chips, EmergencyStop& emergency_stop,
              std::function<CycleView()> view);
  SafetyLines(const SafetyLines&) = delete;
  SafetyLines& operator=(const SafetyLines&) = delete;
  ~SafetyLines() { stop(); }

  /// Asks for the lines and begins to watch; the thread's first look is over when it returns, or else that is a press
  /// (StopSource::kWatcher), so that nothing is energised. Throws DeviceError.
  void start();
  /// Power off, lines given back. May be called twice.
  void stop() noexcept;
  /// The device is open, and sends pulses.
  void allow_power() noexcept { is_open_.store(true, std::memory_order_release); }
  /// What has happened since the last call, for another thread to print: a terminal may block the one that
  /// writes to it. When it is not drained, later lines are dropped.
  [[nodiscard]] std::vector<LogLine> drain_log();

 private:
  enum class Input { kGood, kActive, kUnheard };

  void run() noexcept;
  /// Waits for an edge, or a while.
  [[nodiscard]] Input look();
  [[nodiscard]] Input look_or_lose() noexcept;
  void reopen() noexcept;
  void step(Input input) noexcept;
  /// A press, and its source: one that is heard and one that is assumed are told apart.
  void set_stop(Input input, std::int64_t now_ns) noexcept;
  void switch_outputs(std::int64_t now_ns) noexcept;
  void await_first_look();
  /// Neither cycle nor the device's thread advances.
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
  bool was_active_{false};   ///< since it was pressed
  bool was_unheard_{false};  ///< the same
  bool was_pressed_{false};
  std::atomic<bool> is_open_{false};
  std::atomic<bool> end_{false};
  std::atomic<bool> has_looked_{false};  ///< the thread
  std::mutex mutex_;
  std::vector<LogLine> log_;
  std::thread thread_;
};

}  // namespace corbot::rt
