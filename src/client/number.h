// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace corbot::client {

/// A decimal number with '.' whatever the locale: the whole word, finite; a leading '+' is allowed.
/// Hexadecimal, 'inf' and 'nan' are not.
[[nodiscard]] std::optional<double> parse_number(std::string_view word) noexcept;

/// A decimal integer, the whole word.
[[nodiscard]] std::optional<int> parse_integer(std::string_view word) noexcept;

/// Why parse_number refused a word: "'0,2' is not a number: write a decimal point".
[[nodiscard]] std::string number_fault(std::string_view word);

/// The command line with words such as "-.5" written "-0.5": option parsers take
/// "-." for the begin of an option.
[[nodiscard]] std::vector<std::string> protect_negative_numbers(int argc, const char* const* argv);

}  // namespace corbot::client
