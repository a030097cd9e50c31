// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <chrono>
#include <cstdint>
#include <optional>

namespace corbot {

/// How many refused calls the audit log takes: a burst, then one a second, so that whoever is refused over and over
/// cannot rotate away what has moved the arm. Pure.
class RefusalBudget {
 public:
  using Clock = std::chrono::steady_clock;
  static constexpr int kBurst = 200;
  static constexpr std::chrono::seconds kEach{1};

  /// A call was refused. How many were left out since the last that was taken; nothing: this one is left out, too.
  std::optional<std::uint64_t> take(Clock::time_point now) {
    // `full_at_`: when the whole burst is there again.
    full_at_ = std::max(full_at_, now);
    if (full_at_ - now > kEach * (kBurst - 1)) {
      ++left_out_;
      return std::nullopt;
    }
    full_at_ += kEach;
    const std::uint64_t before = left_out_;
    left_out_ = 0;
    return before;
  }

 private:
  Clock::time_point full_at_{};
  std::uint64_t left_out_{0};
};

}  // namespace corbot
