// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <span>
#include <string_view>

namespace corbot {

/// What most_similar() accepts as a misspelling. An edit: a letter inserted, left out or replaced. Capitals are none.
struct Similarity {
  /// The most edits, for words of these lengths.
  std::size_t (*most_edits)(std::size_t typed, std::size_t word);
  /// A word that begins with what was typed counts as one edit, however much is left out.
  bool prefix_is_one_edit;
};

/// Keys of a profile: an edit for each three letters, and a unit may be left out ("speed" for "speed_deg_s").
extern const Similarity kSimilarKey;
/// Commands: two edits, but never a whole word.
extern const Similarity kSimilarCommand;

/// The word of `words` that `typed` is most likely a misspelling of; empty when none is near.
[[nodiscard]] std::string_view most_similar(std::string_view typed, std::span<const std::string_view> words,
                                            const Similarity& similarity);

}  // namespace corbot
