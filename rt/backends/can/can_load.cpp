// SPDX-License-Identifier: Apache-2.0
#include "rt/backends/can/can_load.h"

#include <cmath>

#include "rt/backends/can/cia402.h"

namespace corbot::rt {

std::int64_t needed_bit_rate(std::size_t drives, std::int64_t period_ns) noexcept {
  const double bits_per_s = static_cast<double>(cycle_bits(drives)) * 1e9 / static_cast<double>(period_ns);
  return std::llround(std::ceil(bits_per_s / kBusShare));
}

std::optional<std::int64_t> sync_period_ns(std::size_t drives, std::int64_t loop_ns,
                                           std::uint32_t bit_rate) noexcept {
  if (loop_ns <= 0) return std::nullopt;
  for (std::int64_t period_ns = loop_ns; period_ns <= kLongestSyncPeriod_ns; period_ns += loop_ns) {
    if (bit_rate != 0 && needed_bit_rate(drives, period_ns) > bit_rate) continue;
    if (interpolation_time(period_ns)) return period_ns;
  }
  return std::nullopt;
}

}  // namespace corbot::rt
