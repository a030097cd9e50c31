// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

namespace corbot::cell {

/// Values at a time. Between two keys they change in straight lines.
struct Key {
  double time_s{};
  std::vector<double> values;
};

/// In order of time, all with the same number of values.
using Track = std::vector<Key>;

/// The track with as few of its keys as this method finds: each value is nowhere further than `tolerance`
/// from the given track's. First and last key remain. (D. Douglas, T. Peucker: Algorithms for the reduction
/// of the number of points, 1973.)
[[nodiscard]] Track simplified(const Track& track, double tolerance);

}  // namespace corbot::cell
