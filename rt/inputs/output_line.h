// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>

#include "rt/backends/gpio/gpio_lines.h"

namespace corbot::rt {

using LogText = std::function<void(std::string)>;

/// One GPIO output of the thread that watches the lines. After a failure it requests the line again, with the
/// level off: a chip that was gone has forgotten the old request.
class OutputLine {
 public:
  static constexpr std::int64_t kRetryAfter_ns = 200'000'000;

  OutputLine(GpioChips& chips, GpioRequest request) : chips_(chips), request_(std::move(request)) {}

  /// Requests the line, which is then off. Throws DeviceError.
  void open() { line_ = chips_.outputs(request_); }
  /// Releases the line.
  void close() noexcept { line_.reset(); }
  /// Makes one system call. Returns 0, or an errno.
  [[nodiscard]] int set(bool on) noexcept;
  /// Requests the line again after a failure, which switches it off. Not before kRetryAfter_ns. Returns
  /// whether it did.
  [[nodiscard]] bool request_again(std::int64_t now_ns) noexcept;
  [[nodiscard]] bool reopen() noexcept;

 private:
  GpioChips& chips_;
  const GpioRequest request_;
  std::unique_ptr<GpioOutputs> line_;
  std::int64_t failed_at_ns_{0};  ///< time of a failure or of a failed request; 0: neither
};

/// The switch of the servos' power. It writes its level again every kRefresh_ns, so that a chip that has gone
/// is noticed before it is needed.
class PowerSwitch {
 public:
  static constexpr std::int64_t kRefresh_ns = 10'000'000;
  static constexpr int kToleratedFailures = 3;

  PowerSwitch(GpioChips& chips, GpioRequest request, LogText log)
      : line_(chips, std::move(request)), log_(std::move(log)) {}
  void open() { line_.open(); }
  void set(bool on, std::int64_t now_ns) noexcept;
  /// Returns the last level set; a failure does not change it.
  [[nodiscard]] bool is_on() const noexcept { return is_on_; }
  /// Several failures in a row have made it unknown whether the servos have power.
  [[nodiscard]] bool is_lost() const noexcept { return failures_ > kToleratedFailures; }
  /// Switches off, with a few tries, and releases the line.
  void end() noexcept;

 private:
  void failed(int error, bool on, std::int64_t now_ns) noexcept;

  OutputLine line_;
  const LogText log_;
  bool is_on_{false};
  std::int64_t set_at_ns_{0};
  int failures_{0};            ///< in a row
  bool is_failing_on_{false};  ///< the level that the last failure was to set
};

}  // namespace corbot::rt
