// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <cstdint>

namespace corbot::soak {

/// A number that belongs to one call alone, hidden in the last digits of its motion's goal. The recorded
/// set-points thus tell a motion's call, whether or not its caller got a ticket. A motion that runs twice
/// shows, too.
inline constexpr std::int64_t kCallsPerClient = 400;
inline constexpr std::int64_t kSignatures = 400'000;

constexpr std::int64_t signature(int client, int move) noexcept {
  return (client * kCallsPerClient + move % kCallsPerClient) % kSignatures;
}

/// Angles lie on a grid of 0.5 degrees, lengths of 0.1 mm, and the signature between two points of it.
inline constexpr double kGrid_deg = 0.5;
inline constexpr double kGrid_m = 1e-4;
inline constexpr double kStep_deg = kGrid_deg / (kSignatures + 1);
inline constexpr double kStep_m = kGrid_m / (kSignatures + 1);

constexpr double sign_degrees(int grid_points, std::int64_t mark) noexcept {
  return grid_points * kGrid_deg + static_cast<double>(mark) * kStep_deg;
}
constexpr double sign_metres(int grid_points, std::int64_t mark) noexcept {
  return grid_points * kGrid_m + static_cast<double>(mark) * kStep_m;
}

/// The signature in a value, or -1 when it lies between two of them by more than rounding explains.
inline std::int64_t read_signature(double value, double grid, double step) noexcept {
  const double rest = value - std::floor(value / grid + 1e-6) * grid;
  const double mark = rest / step;
  const double nearest = std::round(mark);
  if (std::abs(mark - nearest) > 0.2 || nearest < 0 || nearest > static_cast<double>(kSignatures)) return -1;
  return static_cast<std::int64_t>(nearest);
}
inline std::int64_t signature_of_degrees(double degrees) noexcept {
  return read_signature(degrees, kGrid_deg, kStep_deg);
}
inline std::int64_t signature_of_metres(double metres) noexcept {
  return read_signature(metres, kGrid_m, kStep_m);
}

}  // namespace corbot::soak
