// SPDX-License-Identifier: Apache-2.0
// Computes the time of day of an instant on CLOCK_MONOTONIC.
#pragma once

#include <time.h>

#include <cstdint>
#include <limits>

namespace corbot::rt {

/// Returns CLOCK_REALTIME less CLOCK_MONOTONIC, nanoseconds. The two cannot be read in one instant: a
/// preemption between the readings would falsify the result by its length. Such a reading is repeated, up to
/// twice, and the tightest counts. `read` returns the time of a clock, nanoseconds. Real-time safe.
template <class Read>
[[nodiscard]] std::int64_t wall_offset_ns(Read&& read) noexcept {
  constexpr int kReadings = 3;
  constexpr std::int64_t kTight_ns = 20'000;
  std::int64_t offset_ns = 0;
  std::int64_t tightest_ns = std::numeric_limits<std::int64_t>::max();
  for (int reading = 0; reading < kReadings && tightest_ns > kTight_ns; ++reading) {
    const std::int64_t before_ns = read(CLOCK_MONOTONIC);
    const std::int64_t wall_ns = read(CLOCK_REALTIME);
    const std::int64_t span_ns = read(CLOCK_MONOTONIC) - before_ns;
    if (span_ns >= tightest_ns) continue;
    tightest_ns = span_ns;
    offset_ns = wall_ns - before_ns - span_ns / 2;
  }
  return offset_ns;
}

}  // namespace corbot::rt
