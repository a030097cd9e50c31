// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include "rt/inputs/output_line.h"
#include "rt/inputs/watchdog_logic.h"

namespace corbot::rt {

/// The watchdog's GPIO line: see WatchdogLogic. A line that cannot be switched counts as tripped.
class WatchdogOutput {
 public:
  WatchdogOutput(GpioChips& chips, GpioRequest request, std::int64_t period_ns, LogText log)
      : line_(chips, std::move(request)), logic_(period_ns), log_(std::move(log)) {}
  void open() { line_.open(); }
  /// `may_run`: power is allowed.
  void step(std::int64_t now_ns, bool may_run, const CycleView& view) noexcept;
  [[nodiscard]] bool is_tripped() const noexcept { return logic_.is_tripped() || is_lost_; }
  [[nodiscard]] bool is_running() const noexcept { return logic_.is_running(); }
  /// Returns the time until the line has to change, at most `longest_ns`.
  [[nodiscard]] std::int64_t wait_ns(std::int64_t now_ns, std::int64_t longest_ns) const noexcept;
  /// Sets the line low, and releases it.
  void end() noexcept;

 private:
  OutputLine line_;
  WatchdogLogic logic_;
  const LogText log_;
  bool level_{false};
  bool is_lost_{false};
  bool was_running_{false};
};

}  // namespace corbot::rt
