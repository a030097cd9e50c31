// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <string_view>

namespace corbot {

/// The word of `words` that `typed` is most likely a misspelling of; empty when none is near.
[[nodiscard]] std::string_view most_similar(std::string_view typed, std::span<const std::string_view> words);

}  // namespace corbot
