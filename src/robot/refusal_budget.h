// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <chrono>
#include <cstdint>
#include <optional>

namespace corbot {

/// Limits the refused calls in the audit log to a burst, then one a second. Repeated refusals thus cannot
/// rotate out the entries of calls that moved the arm. Pure.
class RefusalBudget {
 public:
  using Clock = std::chrono::steady_clock;
  static constexpr int kBurst = 200;
  static constexpr std::chrono::seconds kEach{1};

  /// Counts a refused call. Returns how many were omitted since the last recorded one, or nothing if this
  /// call is omitted, too.
  std::optional<std::uint64_t> take(Clock::time_point now) {
    // At `full_at_` the whole burst is available again.
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
