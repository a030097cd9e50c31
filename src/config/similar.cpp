// SPDX-License-Identifier: Apache-2.0
#include "config/similar.h"

#include <algorithm>
#include <cstddef>
#include <limits>
#include <numeric>
#include <utility>
#include <vector>

namespace corbot {
namespace {

constexpr std::size_t kLongestWord = 64;

/// Edits between two words: letters inserted, left out, replaced, and neighbours exchanged.
std::size_t edit_distance(std::string_view a, std::string_view b) {
  std::vector<std::size_t> before(b.size() + 1);  // the rows of the last two letters of `a`, and of this one
  std::vector<std::size_t> above(b.size() + 1);
  std::vector<std::size_t> row(b.size() + 1);
  std::iota(row.begin(), row.end(), std::size_t{0});
  for (std::size_t i = 1; i <= a.size(); ++i) {
    std::swap(before, above);
    std::swap(above, row);
    row[0] = i;
    for (std::size_t j = 1; j <= b.size(); ++j) {
      const std::size_t replace = above[j - 1] + (a[i - 1] == b[j - 1] ? 0 : 1);
      row[j] = std::min({above[j] + 1, row[j - 1] + 1, replace});
      if (i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1]) {
        row[j] = std::min(row[j], before[j - 2] + 1);
      }
    }
  }
  return row.back();
}

}  // namespace

std::string_view most_similar(std::string_view typed, std::span<const std::string_view> words) {
  if (typed.size() > kLongestWord) return {};
  std::string_view best;
  std::size_t best_distance = std::numeric_limits<std::size_t>::max();
  for (const std::string_view word : words) {
    // A left-out unit ("speed" for "speed_deg_s") is the likeliest slip, however long the unit.
    const bool unit_missing = typed.size() >= 2 && word.starts_with(typed);
    const std::size_t distance = unit_missing ? 1 : edit_distance(typed, word);
    const std::size_t tolerated = std::max<std::size_t>(1, std::min(typed.size(), word.size()) / 3);
    if (distance < best_distance && distance <= tolerated) {
      best_distance = distance;
      best = word;
    }
  }
  return best;
}

}  // namespace corbot
