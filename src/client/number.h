// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace corbot::client {

/// Parses a decimal number with '.' in any locale: the whole word, finite; a leading '+' is allowed. Refuses
/// hexadecimal, 'inf' and 'nan'.
[[nodiscard]] std::optional<double> parse_number(std::string_view word) noexcept;

/// Parses a decimal integer, the whole word.
[[nodiscard]] std::optional<int> parse_integer(std::string_view word) noexcept;

/// Returns why parse_number refused a word: "'0,2' is not a number: write a decimal point".
[[nodiscard]] std::string number_fault(std::string_view word);

/// Returns "" for a whole number within the bounds, else why it is refused: "'x' is not a whole number from
/// 0 to 9". Refuses leading zeros.
[[nodiscard]] std::string whole_number_fault(std::string_view word, std::int64_t low, std::int64_t high);

/// Returns the command line with words such as "-.5" written "-0.5": option parsers take "-." for the
/// beginning of an option.
[[nodiscard]] std::vector<std::string> protect_negative_numbers(int argc, const char* const* argv);

}  // namespace corbot::client
