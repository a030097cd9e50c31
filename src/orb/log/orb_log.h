// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstdint>
#include <optional>
#include <utility>

namespace corbot::orb {

/// Admits at most 100 messages in each minute, which begins with its first message. Not thread-safe.
class LogLimit {
 public:
  using Clock = std::chrono::steady_clock;
  static constexpr int kMost = 100;
  static constexpr auto kPeriod = std::chrono::minutes(1);

  /// Returns nothing if the message is to be left out. Otherwise returns the number of those that were left
  /// out since the previous one.
  [[nodiscard]] std::optional<std::uint64_t> admit(Clock::time_point now) noexcept {
    if (admitted_ == 0 || now - began_ >= kPeriod) {
      began_ = now;
      admitted_ = 0;
    }
    if (admitted_ == kMost) {
      ++left_out_;
      return std::nullopt;
    }
    ++admitted_;
    return std::exchange(left_out_, 0);
  }

 private:
  Clock::time_point began_{};
  int admitted_{0};
  std::uint64_t left_out_{0};
};

/// Limits the ORB's own messages on standard error. Without a limit, each malformed request of any client
/// adds one, and a flood fills the disk that has the log. No message waits for a reader (LineOutput), since
/// each would hold a connection's thread. An ORB that writes a trace, or a file of its own, keeps all. Call
/// this after the ORB's start, which reads these options.
void limit_orb_log();

}  // namespace corbot::orb
