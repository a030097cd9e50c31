// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

namespace corbot::cell {

/// Values at a time. The values between two keys are interpolated linearly.
struct Key {
  double time_s{};
  std::vector<double> values;
};

/// Keys in order of time, all with the same number of values.
using Track = std::vector<Key>;

/// Returns the track with fewer keys. Each value differs from the given track's by at most `tolerance`. First
/// and last key remain. Source: D. Douglas, T. Peucker: Algorithms for the reduction of the number of points,
/// 1973.
[[nodiscard]] Track simplified(const Track& track, double tolerance);

}  // namespace corbot::cell
