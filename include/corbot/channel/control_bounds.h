// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstddef>
#include <string_view>

// The bounds of Acquire's arguments. Not real-time.

namespace corbot {

inline constexpr double kShortestLease_s = 0.5;
inline constexpr double kLongestLease_s = 3600.0;
inline constexpr std::size_t kLongestHolderName = 64;

[[nodiscard]] constexpr bool is_holder_name(std::string_view who) noexcept {
  return !who.empty() && who.size() <= kLongestHolderName &&
         std::all_of(who.begin(), who.end(), [](char c) { return c >= ' ' && c <= '~'; });
}

}  // namespace corbot
