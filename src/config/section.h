// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <toml++/toml.h>

#include "config/profile.h"

namespace corbot {

/// The allowed values of a number; messages contain them.
struct Bounds {
  double lower;
  double upper;
  bool above_lower{false};  ///< the lower bound itself is excluded
  std::string_view unit{};
};

inline constexpr Bounds kHalfTurn_deg{-180, 180, false, "degrees"};
/// A limit of a motion: positive, and small enough that no product of limits overflows.
constexpr Bounds limit(std::string_view unit) { return {0, 1e6, true, unit}; }
/// Longest path of a Unix socket, bytes.
inline constexpr std::size_t kLongestSocket = 107;

/// Collects faults while a profile is read.
struct FaultList {
  std::string file;
  std::vector<ConfigFault> faults;
  void add(std::uint32_t line, std::string key, std::string value, std::string allowed);
};

/// A table of a profile while it is read. Every reader reports a fault and then returns nothing; one pass
/// therefore finds all faults. finish() reports unread keys as unknown.
class Section {
 public:
  /// `table` may be null: its absence has been reported, so its keys are not reported one by one. `name` is
  /// the full key, empty at the top.
  Section(const toml::table* table, std::string name, FaultList& faults);

  [[nodiscard]] std::optional<double> number(std::string_view key, const Bounds& allowed);
  [[nodiscard]] std::optional<double> number_or(std::string_view key, double fallback, const Bounds& allowed);
  [[nodiscard]] std::optional<std::int64_t> integer(std::string_view key, const Bounds& allowed);
  [[nodiscard]] std::optional<std::int64_t> integer_or(std::string_view key, std::int64_t fallback,
                                                       const Bounds& allowed);
  [[nodiscard]] std::optional<bool> flag_or(std::string_view key, bool fallback);
  [[nodiscard]] std::optional<std::string> text(std::string_view key);
  [[nodiscard]] std::optional<std::string> text_or(std::string_view key, std::string fallback);
  /// Reads exactly `count` numbers.
  [[nodiscard]] std::optional<std::vector<double>> numbers(std::string_view key, std::size_t count,
                                                           const Bounds& allowed);
  /// Reads one text or more, at most `most`.
  [[nodiscard]] std::optional<std::vector<std::string>> texts(std::string_view key, std::size_t most);
  /// Reads two numbers, the lower first.
  [[nodiscard]] std::optional<std::array<double, 2>> range(std::string_view key, const Bounds& allowed);

  [[nodiscard]] Section table(std::string_view key);           ///< must exist
  [[nodiscard]] Section table_or_empty(std::string_view key);  ///< may be absent
  /// Reads an array of tables ([[key]]), which must exist; returns an empty list after a fault.
  [[nodiscard]] std::vector<Section> tables(std::string_view key);

  /// Accepts a known key that has been read elsewhere or is not needed.
  void skip(std::string_view key) { read_keys_.push_back(key); }
  /// Reports that `wrong` stands in place of `right`. Then neither `right` is reported as missing, nor
  /// `wrong` as unknown.
  void refuse_for(std::string_view wrong, std::string_view right, const std::string& why);
  /// Reports a fault of a value that was readable.
  void refuse(std::string_view key, std::string allowed);
  /// Reports the keys that were not read.
  void finish();

  [[nodiscard]] bool present() const noexcept { return table_ != nullptr; }
  [[nodiscard]] bool has(std::string_view key) const { return table_ != nullptr && table_->contains(key); }
  [[nodiscard]] std::uint32_t line_of(std::string_view key) const;
  [[nodiscard]] std::string full_key(std::string_view key) const;

 private:
  const toml::node* find(std::string_view key, bool required);
  std::optional<double> finite(const toml::node& node, const std::string& key, const Bounds& allowed);
  std::optional<std::int64_t> whole(const toml::node& node, const std::string& key, const Bounds& allowed);
  const toml::array* array_of(std::string_view key, const toml::node& node, std::size_t count);

  const toml::table* table_;
  std::string name_;
  FaultList* faults_;
  std::vector<std::string_view> read_keys_;
  std::vector<std::string_view> excused_;  ///< their absence has been reported otherwise
};

}  // namespace corbot
