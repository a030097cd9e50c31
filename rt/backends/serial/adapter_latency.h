// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>

namespace corbot::rt {

/// The longest latency that costs no frames.
inline constexpr int kGoodLatency_ms = 2;

/// Returns the time for which the USB adapter of a serial line keeps received data. Returns nothing if its
/// driver has no such timer. `path` may be a symbolic link.
[[nodiscard]] std::optional<int> latency_timer_ms(const std::string& path,
                                                  const std::string& ttys = "/sys/class/tty");

/// Returns the remedy for the log; empty if the latency is good, or not known.
[[nodiscard]] std::string latency_warning(std::optional<int> latency_ms);

}  // namespace corbot::rt
