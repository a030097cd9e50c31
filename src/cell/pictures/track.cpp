// SPDX-License-Identifier: Apache-2.0
#include "cell/pictures/track.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <utility>

namespace corbot::cell {
namespace {

/// Returns the largest deviation of a key's values from the straight lines between two other keys.
double deviation(const Key& key, const Key& from, const Key& to) {
  const double span_s = to.time_s - from.time_s;
  const double share = span_s > 0 ? (key.time_s - from.time_s) / span_s : 0;
  double largest = 0;
  for (std::size_t i = 0; i < key.values.size(); ++i) {
    const double straight = from.values[i] + share * (to.values[i] - from.values[i]);
    largest = std::max(largest, std::abs(key.values[i] - straight));
  }
  return largest;
}

}  // namespace

Track simplified(const Track& track, double tolerance) {
  if (track.size() < 3) return track;
  std::vector<bool> is_kept(track.size(), false);
  is_kept.front() = is_kept.back() = true;
  std::vector<std::pair<std::size_t, std::size_t>> spans{{0, track.size() - 1}};
  while (!spans.empty()) {
    const auto [from, to] = spans.back();
    spans.pop_back();
    double largest = tolerance;
    std::size_t farthest = from;
    for (std::size_t i = from + 1; i < to; ++i) {
      const double found = deviation(track[i], track[from], track[to]);
      if (found <= largest) continue;
      largest = found;
      farthest = i;
    }
    if (farthest == from) continue;
    is_kept[farthest] = true;
    spans.emplace_back(from, farthest);
    spans.emplace_back(farthest, to);
  }
  Track kept;
  for (std::size_t i = 0; i < track.size(); ++i) {
    if (is_kept[i]) kept.push_back(track[i]);
  }
  return kept;
}

}  // namespace corbot::cell
