// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>

namespace corbot::rt {

/// Above it, an adapter costs frames.
inline constexpr int kGoodLatency_ms = 2;

/// How long the USB adapter of a serial line keeps what it has received before it hands it over; nothing
/// where its driver has no such timer. `path` may be a symbolic link.
[[nodiscard]] std::optional<int> latency_timer_ms(const std::string& path,
                                                  const std::string& ttys = "/sys/class/tty");

/// For the log: what to do about it; empty where it is good, or not known.
[[nodiscard]] std::string latency_warning(std::optional<int> latency_ms);

}  // namespace corbot::rt
