// SPDX-License-Identifier: Apache-2.0
#include "client/number.h"

#include <fmt/format.h>

#include <charconv>
#include <cmath>

#include "client/printable.h"

namespace corbot::client {

namespace {

std::string_view without_plus(std::string_view word) noexcept {
  if (word.size() > 1 && word[0] == '+' && word[1] != '-' && word[1] != '+') word.remove_prefix(1);
  return word;
}

}  // namespace

std::optional<double> parse_number(std::string_view word) noexcept {
  word = without_plus(word);
  double value{};
  const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
  if (error != std::errc{} || end != word.data() + word.size() || !std::isfinite(value)) return std::nullopt;
  return value;
}

std::optional<int> parse_integer(std::string_view word) noexcept {
  word = without_plus(word);
  int value{};
  const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
  if (error != std::errc{} || end != word.data() + word.size()) return std::nullopt;
  return value;
}

std::string number_fault(std::string_view word) {
  if (word.find(',') != std::string_view::npos) {
    return fmt::format("'{}' is not a number: write a decimal point, and spaces between numbers", word);
  }
  double value{};
  const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
  if (error == std::errc::result_out_of_range)
    return fmt::format("'{}' is too large or too small for a number", word);
  if (error == std::errc{} && end == word.data() + word.size()) {
    return fmt::format("'{}' is not a finite number", word);
  }
  const std::string_view rest =
      error == std::errc{} ? word.substr(static_cast<std::size_t>(end - word.data())) : "";
  for (const std::string_view unit : {"m", "cm", "mm", "deg", "rad", "s", "ms", "%"}) {
    if (rest == unit) return fmt::format("'{}' is not a number: write it without '{}'", word, unit);
  }
  return fmt::format("'{}' is not a number", word);
}

std::string whole_number_fault(std::string_view word, std::int64_t low, std::int64_t high) {
  std::int64_t value{};
  const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
  const bool is_whole = error == std::errc{} && end == word.data() + word.size();
  const bool is_octal = is_whole && fmt::to_string(value) != word;  // option parsers read "010" as 8
  if (is_whole && !is_octal && value >= low && value <= high) return {};
  return fmt::format("'{}' is not a whole number from {} to {}", printable(word), low, high);
}

std::vector<std::string> protect_negative_numbers(int argc, const char* const* argv) {
  std::vector<std::string> words;
  for (int i = 1; i < argc; ++i) {
    std::string word = argv[i];
    if (word.starts_with("-.") && parse_number(word)) word.replace(0, 1, "-0");
    words.push_back(std::move(word));
  }
  return words;
}

}  // namespace corbot::client
