// SPDX-License-Identifier: Apache-2.0
// The load that a bus can carry.
#pragma once

#include <cstdint>
#include <optional>

namespace corbot::rt {

/// The largest used share of the bus's time; the rest is for heartbeats, SDO, EMCY and repetitions.
inline constexpr double kBusShare = 0.8;
/// The longest period at which an arm may be run.
inline constexpr std::int64_t kLongestSyncPeriod_ns = 100'000'000;

/// Returns the bits of a data frame with an 11-bit identifier and `bytes` of data. It counts the greatest
/// possible number of stuff bits, and the space after the frame.
[[nodiscard]] constexpr std::int64_t frame_bits(std::int64_t bytes) noexcept {
  return 47 + 8 * bytes + (34 + 8 * bytes - 1) / 4;
}

/// Returns the bits of one cycle: SYNC, and controlword with target and statusword with position for every
/// drive.
[[nodiscard]] constexpr std::int64_t cycle_bits(std::size_t drives) noexcept {
  return frame_bits(0) + static_cast<std::int64_t>(drives) * 2 * frame_bits(6);
}

/// Returns the bit rate that cycles of this period need, in bits a second.
[[nodiscard]] std::int64_t needed_bit_rate(std::size_t drives, std::int64_t period_ns) noexcept;

/// Returns the shortest whole number of loop periods that the bus can carry and 60C2h can express. It returns
/// nothing if that is longer than kLongestSyncPeriod_ns. `bit_rate` 0: unknown, taken as enough.
[[nodiscard]] std::optional<std::int64_t> sync_period_ns(std::size_t drives, std::int64_t loop_ns,
                                                         std::uint32_t bit_rate) noexcept;

}  // namespace corbot::rt
