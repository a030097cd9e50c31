// SPDX-License-Identifier: Apache-2.0
#include "config/section.h"

#include <algorithm>
#include <cmath>
#include <sstream>
#include <utility>

#include <fmt/format.h>

#include "config/similar.h"

namespace corbot {
namespace {

constexpr std::size_t kLongestShownValue = 60;

std::uint32_t line_of_node(const toml::node& node) {
  return static_cast<std::uint32_t>(node.source().begin.line);
}

std::string shorten(std::string text) {
  if (text.size() <= kLongestShownValue) return text;
  text.resize(kLongestShownValue);
  return text + "...";
}

/// Returns the value as a person finds it in the file. Numbers use fmt: the shortest text that reads back the
/// same.
std::string shown(const toml::node& node) {
  if (const auto* real = node.as_floating_point()) return fmt::format("{}", real->get());
  if (const auto* whole = node.as_integer()) return fmt::format("{}", whole->get());
  if (node.is_table()) return "a table";
  if (const auto* array = node.as_array()) {
    std::string text;
    for (const toml::node& element : *array) {
      text += (text.empty() ? "" : ", ") + shown(element);
      if (text.size() > kLongestShownValue) break;
    }
    return shorten("[" + text + "]");
  }
  std::ostringstream out;
  node.visit([&out](const auto& value) {
    if constexpr (toml::is_value<decltype(value)>) out << value;
  });
  if (node.is_string()) return shorten("\"" + node.as_string()->get() + "\"");
  return shorten(out.str());
}

std::string describe(const Bounds& bounds, std::string_view what) {
  const std::string unit = bounds.unit.empty() ? "" : fmt::format(" {}", bounds.unit);
  if (bounds.above_lower)
    return fmt::format("{} above {} and at most {}{}", what, bounds.lower, bounds.upper, unit);
  return fmt::format("{} from {} to {}{}", what, bounds.lower, bounds.upper, unit);
}

bool within(double value, const Bounds& bounds) {
  return value <= bounds.upper && (bounds.above_lower ? value > bounds.lower : value >= bounds.lower);
}

/// Returns a hint with a separator in front, for a length that no arm has.
std::string metres_hint(const std::optional<double>& value, const Bounds& allowed) {
  const bool is_long = value && std::isfinite(*value) && std::abs(*value) > allowed.upper;
  return is_long && allowed.unit == "m" ? "; numbers are metres: 20 cm is 0.20" : "";
}

}  // namespace

void FaultList::add(std::uint32_t line, std::string key, std::string value, std::string allowed) {
  faults.push_back({file, line, std::move(key), std::move(value), std::move(allowed), ""});
}

Section::Section(const toml::table* table, std::string name, FaultList& faults)
    : table_{table}, name_{std::move(name)}, faults_{&faults} {}

std::string Section::full_key(std::string_view key) const {
  return name_.empty() ? std::string{key} : fmt::format("{}.{}", name_, key);
}

std::uint32_t Section::line_of(std::string_view key) const {
  if (table_ == nullptr) return 0;
  const toml::node* node = table_->get(key);
  return line_of_node(node != nullptr ? *node : *table_);
}

const toml::node* Section::find(std::string_view key, bool required) {
  read_keys_.push_back(key);
  if (table_ == nullptr) return nullptr;
  const toml::node* node = table_->get(key);
  const bool is_excused = std::find(excused_.begin(), excused_.end(), key) != excused_.end();
  if (node == nullptr && required && !is_excused) faults_->add(line_of(key), full_key(key), "", "is missing");
  return node;
}

std::optional<double> Section::finite(const toml::node& node, const std::string& key, const Bounds& allowed) {
  const std::optional<double> value = node.is_number() ? node.value<double>() : std::nullopt;
  if (value && std::isfinite(*value) && within(*value, allowed)) return value;
  faults_->add(line_of_node(node), key, shown(node),
               "must be " + describe(allowed, "a number") + metres_hint(value, allowed));
  return std::nullopt;
}

std::optional<std::int64_t> Section::whole(const toml::node& node, const std::string& key,
                                           const Bounds& allowed) {
  if (const auto* value = node.as_integer()) {
    if (within(static_cast<double>(value->get()), allowed)) return value->get();
  }
  faults_->add(line_of_node(node), key, shown(node), "must be " + describe(allowed, "a whole number"));
  return std::nullopt;
}

std::optional<double> Section::number(std::string_view key, const Bounds& allowed) {
  const toml::node* node = find(key, true);
  return node != nullptr ? finite(*node, full_key(key), allowed) : std::nullopt;
}

std::optional<double> Section::number_or(std::string_view key, double fallback, const Bounds& allowed) {
  const toml::node* node = find(key, false);
  return node != nullptr ? finite(*node, full_key(key), allowed) : fallback;
}

std::optional<std::int64_t> Section::integer(std::string_view key, const Bounds& allowed) {
  const toml::node* node = find(key, true);
  return node != nullptr ? whole(*node, full_key(key), allowed) : std::nullopt;
}

std::optional<std::int64_t> Section::integer_or(std::string_view key, std::int64_t fallback,
                                                const Bounds& allowed) {
  const toml::node* node = find(key, false);
  return node != nullptr ? whole(*node, full_key(key), allowed) : fallback;
}

std::optional<bool> Section::flag_or(std::string_view key, bool fallback) {
  const toml::node* node = find(key, false);
  if (node == nullptr) return fallback;
  if (const auto* value = node->as_boolean()) return value->get();
  refuse(key, "must be true or false");
  return std::nullopt;
}

std::optional<std::string> Section::text(std::string_view key) {
  const toml::node* node = find(key, true);
  if (node == nullptr) return std::nullopt;
  if (const auto* value = node->as_string()) return value->get();
  refuse(key, "must be a string");
  return std::nullopt;
}

std::optional<std::string> Section::text_or(std::string_view key, std::string fallback) {
  return has(key) ? text(key) : (read_keys_.push_back(key), std::move(fallback));
}

const toml::array* Section::array_of(std::string_view key, const toml::node& node, std::size_t count) {
  const toml::array* array = node.as_array();
  if (array != nullptr && array->size() == count) return array;
  refuse(key, fmt::format("must be {} numbers in brackets", count));
  return nullptr;
}

std::optional<std::vector<double>> Section::numbers(std::string_view key, std::size_t count,
                                                    const Bounds& allowed) {
  const toml::node* node = find(key, true);
  const toml::array* array = node != nullptr ? array_of(key, *node, count) : nullptr;
  if (array == nullptr) return std::nullopt;
  std::vector<double> values;
  for (std::size_t i = 0; i < count; ++i) {
    const auto value = finite((*array)[i], fmt::format("{}[{}]", full_key(key), i), allowed);
    if (value) values.push_back(*value);
  }
  return values.size() == count ? std::optional{values} : std::nullopt;
}

std::optional<std::vector<std::string>> Section::texts(std::string_view key, std::size_t most) {
  const toml::node* node = find(key, true);
  if (node == nullptr) return std::nullopt;
  const toml::array* array = node->as_array();
  std::vector<std::string> values;
  for (std::size_t i = 0; array != nullptr && i < array->size(); ++i) {
    if (const auto* value = (*array)[i].as_string()) values.push_back(value->get());
  }
  if (array != nullptr && !values.empty() && values.size() <= most && values.size() == array->size()) {
    return values;
  }
  refuse(key, fmt::format("must be 1 to {} strings in brackets", most));
  return std::nullopt;
}

std::optional<std::array<double, 2>> Section::range(std::string_view key, const Bounds& allowed) {
  const auto ends = numbers(key, 2, allowed);
  if (!ends) return std::nullopt;
  if ((*ends)[0] < (*ends)[1]) return std::array{(*ends)[0], (*ends)[1]};
  refuse(key, "must be [LOWER, UPPER], with LOWER below UPPER");
  return std::nullopt;
}

Section Section::table(std::string_view key) {
  const toml::node* node = find(key, false);
  if (node == nullptr && table_ != nullptr) {
    faults_->add(line_of(key), full_key(key), "",
                 fmt::format("is missing: add a table [{}] to the profile", full_key(key)));
  }
  if (node != nullptr && !node->is_table()) refuse(key, fmt::format("must be a table, [{}]", full_key(key)));
  return Section{node != nullptr ? node->as_table() : nullptr, full_key(key), *faults_};
}

Section Section::table_or_empty(std::string_view key) {
  static const toml::table empty;
  if (table_ != nullptr && has(key)) return table(key);
  read_keys_.push_back(key);
  return Section{&empty, full_key(key), *faults_};
}

std::vector<Section> Section::tables(std::string_view key) {
  const toml::node* node = find(key, true);
  if (node == nullptr) return {};
  const toml::array* array = node->as_array();
  std::vector<Section> sections;
  for (std::size_t i = 0; array != nullptr && i < array->size(); ++i) {
    if (const toml::table* element = (*array)[i].as_table()) {
      sections.emplace_back(element, fmt::format("{}[{}]", full_key(key), i), *faults_);
    }
  }
  if (array != nullptr && !sections.empty() && sections.size() == array->size()) return sections;
  refuse(key, fmt::format("must be tables, each beginning with [[{}]]", full_key(key)));
  return {};
}

void Section::refuse(std::string_view key, std::string allowed) {
  const toml::node* node = table_ != nullptr ? table_->get(key) : nullptr;
  faults_->add(line_of(key), full_key(key), node != nullptr ? shown(*node) : "", std::move(allowed));
}

void Section::refuse_for(std::string_view wrong, std::string_view right, const std::string& why) {
  refuse(wrong, fmt::format("must be {}: {}", right, why));
  skip(wrong);
  excused_.push_back(right);
}

void Section::finish() {
  if (table_ == nullptr) return;
  for (const auto& [key, node] : *table_) {
    if (std::find(read_keys_.begin(), read_keys_.end(), key.str()) != read_keys_.end()) continue;
    const std::string_view similar = most_similar(key.str(), read_keys_, kSimilarKey);
    faults_->add(static_cast<std::uint32_t>(key.source().begin.line), full_key(key.str()), shown(node),
                 similar.empty() ? fmt::format("is unknown; allowed here: {}", fmt::join(read_keys_, ", "))
                                 : fmt::format("is unknown; did you mean {}?", similar));
  }
}

}  // namespace corbot
