// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "corbot/backend/emergency_stop.h"
#include "corbot/backend/log_line.h"
#include "rt/backends/gpio/gpio_lines.h"
#include "rt/inputs/stop_logic.h"

namespace corbot::rt {

struct SafetySettings {
  std::optional<GpioRequest> stop;   ///< the input of an emergency stop
  std::optional<GpioRequest> power;  ///< the output that lets the servos have power
  bool off_at_stop{true};
  int priority{0};  ///< SCHED_FIFO, where permitted; 0: an ordinary thread
};

/// What the cycle has published last; before its first step, what the one of the task before has.
struct CycleView {
  std::uint64_t cycle{};
  bool in_error{};
};

/// The emergency stop input and the servos' power, watched by one thread, whatever drives the servos. A press
/// reaches EmergencyStop by the line's edge, or at the latest when its level is next looked at, kLook_ns
/// later. A chip that goes away counts as a press, and is tried again, as is a switch that failed. Power is
/// off before allow_power(), after stop(), and from a stop of any source, or from a start in Error, until it
/// is cleared, where so set.
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

  /// Asks for the lines and begins to watch; the first look is over when it returns. Throws DeviceError.
  void start();
  /// Power off, lines given back. May be called twice.
  void stop() noexcept;
  /// The device is open, and sends pulses.
  void allow_power() noexcept { is_open_.store(true, std::memory_order_release); }
  /// What has happened since the last call, for another thread to print: a terminal may block the one that
  /// writes to it. When it is not drained, later lines are dropped.
  [[nodiscard]] std::vector<LogLine> drain_log();

 private:
  void run() noexcept;
  /// Waits for an edge, or a while. Whether the stop must be taken for pressed.
  [[nodiscard]] bool look();
  void reopen() noexcept;
  void step(bool is_bad) noexcept;
  void switch_power() noexcept;
  void request_output_again() noexcept;
  void switch_off_at_end() noexcept;
  void log(std::string text);

  const SafetySettings settings_;
  const std::unique_ptr<GpioChips> chips_;
  EmergencyStop& emergency_stop_;
  const std::function<CycleView()> view_;

  StopLogic stop_logic_;
  PowerLogic power_logic_;
  std::unique_ptr<GpioInput> input_;
  std::unique_ptr<GpioOutputs> output_;
  std::int64_t reopen_at_ns_{0};
  bool is_powered_{false};  ///< as the line was last set; a failure leaves it as it was
  int power_error_{0};      ///< of the last try
  std::int64_t retry_at_ns_{0};
  bool was_pressed_{false};
  std::atomic<bool> is_open_{false};
  std::atomic<bool> end_{false};
  std::mutex mutex_;
  std::vector<LogLine> log_;
  std::thread thread_;
};

}  // namespace corbot::rt
