// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <span>
#include <string_view>

namespace corbot {

/// The misspellings that most_similar() accepts. An edit inserts, omits or replaces a letter. Capitals are no
/// edits.
struct Similarity {
  /// Returns the most edits, for words of these lengths.
  std::size_t (*most_edits)(std::size_t typed, std::size_t word);
  /// A word that begins with the typed text counts as one edit, however much is omitted.
  bool prefix_is_one_edit;
};

/// Keys of a profile: one edit for each three letters, and a unit may be omitted ("speed" for "speed_deg_s").
extern const Similarity kSimilarKey;
/// Commands: two edits, one if three letters or fewer are typed, but never a whole word.
extern const Similarity kSimilarCommand;

/// Returns the word in `words` that `typed` most likely misspells, or "" if none is similar.
[[nodiscard]] std::string_view most_similar(std::string_view typed, std::span<const std::string_view> words,
                                            const Similarity& similarity);

}  // namespace corbot
