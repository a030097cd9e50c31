// SPDX-License-Identifier: Apache-2.0
#include "config/similar.h"

#include <algorithm>
#include <cctype>
#include <cstddef>
#include <limits>
#include <numeric>
#include <vector>

namespace corbot {
namespace {

constexpr std::size_t kLongestWord = 64;

bool is_same(char a, char b) {
  return std::tolower(static_cast<unsigned char>(a)) == std::tolower(static_cast<unsigned char>(b));
}

/// Returns the Levenshtein distance, one row at a time; capital letters are no edits.
std::size_t edit_distance(std::string_view a, std::string_view b) {
  std::vector<std::size_t> row(b.size() + 1);
  std::iota(row.begin(), row.end(), std::size_t{0});
  for (std::size_t i = 1; i <= a.size(); ++i) {
    std::size_t diagonal = row[0];
    row[0] = i;
    for (std::size_t j = 1; j <= b.size(); ++j) {
      const std::size_t replace = diagonal + (is_same(a[i - 1], b[j - 1]) ? 0 : 1);
      diagonal = row[j];
      row[j] = std::min({row[j] + 1, row[j - 1] + 1, replace});
    }
  }
  return row.back();
}

}  // namespace

const Similarity kSimilarKey{
    [](std::size_t typed, std::size_t word) { return std::max<std::size_t>(1, std::min(typed, word) / 3); },
    true};

const Similarity kSimilarCommand{[](std::size_t typed, std::size_t word) {
                                   const std::size_t most = typed > 3 ? 2 : 1;
                                   return word == 0 ? 0 : std::min<std::size_t>(most, word - 1);
                                 },
                                 false};

std::string_view most_similar(std::string_view typed, std::span<const std::string_view> words,
                              const Similarity& similarity) {
  if (typed.size() > kLongestWord) return {};
  std::string_view best;
  std::size_t best_distance = std::numeric_limits<std::size_t>::max();
  for (const std::string_view word : words) {
    const bool is_prefix = similarity.prefix_is_one_edit && typed.size() >= 2 && word.starts_with(typed);
    const std::size_t distance = is_prefix ? 1 : edit_distance(typed, word);
    if (distance < best_distance && distance <= similarity.most_edits(typed.size(), word.size())) {
      best_distance = distance;
      best = word;
    }
  }
  return best;
}

}  // namespace corbot
