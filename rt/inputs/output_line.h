// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>

#include "rt/backends/gpio/gpio_lines.h"

namespace corbot::rt {

using LogText = std::function<void(std::string)>;

/// One GPIO output of the thread that watches the lines. After a failure the line is requested again, and then off:
/// a chip that was gone has forgotten the old request.
class OutputLine {
 public:
  static constexpr std::int64_t kRetryAfter_ns = 200'000'000;

  OutputLine(GpioChips& chips, GpioRequest request) : chips_(chips), request_(std::move(request)) {}

  /// Throws DeviceError. The line is off.
  void open() { line_ = chips_.outputs(request_); }
  /// Gives the line back.
  void close() noexcept { line_.reset(); }
  /// One system call; 0, or an errno.
  [[nodiscard]] int set(bool on) noexcept;
  /// Whether it has been requested again, and so switched off, after a failure; not before kRetryAfter_ns.
  [[nodiscard]] bool request_again(std::int64_t now_ns) noexcept;
  [[nodiscard]] bool reopen() noexcept;

 private:
  GpioChips& chips_;
  const GpioRequest request_;
  std::unique_ptr<GpioOutputs> line_;
  std::int64_t failed_at_ns_{0};  ///< or requested in vain; 0: neither
};

/// The switch of the servos' power. What it was set to is written again every kRefresh_ns, so that a chip that has gone is
/// noticed before it is needed.
class PowerSwitch {
 public:
  static constexpr std::int64_t kRefresh_ns = 10'000'000;
  static constexpr int kToleratedFailures = 3;

  PowerSwitch(GpioChips& chips, GpioRequest request, LogText log)
      : line_(chips, std::move(request)), log_(std::move(log)) {}
  void open() { line_.open(); }
  void set(bool on, std::int64_t now_ns) noexcept;
  /// As the line was last set; a failure leaves it as it was.
  [[nodiscard]] bool is_on() const noexcept { return is_on_; }
  /// It has failed several times in a row: whether the servos have power is unknown.
  [[nodiscard]] bool is_lost() const noexcept { return failures_ > kToleratedFailures; }
  /// Off, with a few tries, and given back.
  void end() noexcept;

 private:
  void failed(int error, bool on, std::int64_t now_ns) noexcept;

  OutputLine line_;
  const LogText log_;
  bool is_on_{false};
  std::int64_t set_at_ns_{0};
  int failures_{0};            ///< in a row
  bool is_failing_on_{false};  ///< what the last one was to be
};

}  // namespace corbot::rt
