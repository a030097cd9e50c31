// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <CLI/CLI.hpp>
#include <cstdint>
#include <string>

#include <fmt/format.h>

#include "client/number.h"

namespace corbot::client {

/// Validates the number of an option with the messages used elsewhere. CLI11 would accept "nan", "0x10" and
/// " 1", too.
inline CLI::Validator number_within(double low, double high) {
  return CLI::Validator(
      [low, high](std::string& word) {
        const auto value = parse_number(word);
        if (!value) return number_fault(word);
        if (*value >= low && *value <= high) return std::string();
        return fmt::format("{} is out of range: allowed are {} to {}", word, low, high);
      },
      fmt::format("{} to {}", low, high));
}

/// Validates the whole number of an option or an argument. CLI11 would take "-1" for a large number.
inline CLI::Validator whole_number_within(std::int64_t low, std::int64_t high) {
  return CLI::Validator([low, high](std::string& word) { return whole_number_fault(word, low, high); },
                        fmt::format("{} to {}", low, high));
}

}  // namespace corbot::client
