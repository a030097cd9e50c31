// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <CLI/CLI.hpp>
#include <string>

#include <fmt/format.h>

namespace corbot::client {

/// Writes a help without the notation of CLI11: "POSE(3x)", "ORB:{a,b}", "REQUIRED", "Needs:". The
/// usage shows which arguments are required.
class HelpFormatter : public CLI::Formatter {
 public:
  std::string make_option_usage(const CLI::Option* option) const override {
    const bool is_list = option->get_expected_max() >= CLI::detail::expected_max_vector_size;
    const std::string name = make_option_name(option, true) + (is_list ? "..." : "");
    return option->get_required() ? name : "[" + name + "]";
  }

  /// Writes the value's name, its range, and the conditions of the option.
  std::string make_option_opts(const CLI::Option* option) const override {
    const std::string type = option->get_type_size() != 0 ? option->get_type_name() : "";
    const auto colon = type.find(':');
    std::string text = type.substr(0, colon);
    if (!text.empty()) text = " " + text;
    if (colon != std::string::npos) text += fmt::format(" ({})", allowed(type.substr(colon + 1)));
    if (option->get_required() && !option->get_positional()) text += " (required)";
    return text + names(", with", option->get_needs()) + names(", without", option->get_excludes());
  }

 private:
  /// Writes a set "{a,b}" as "a or b"; a range is in words already.
  static std::string allowed(const std::string& values) {
    if (!values.starts_with('{')) return values;
    return CLI::detail::find_and_replace(values.substr(1, values.size() - 2), ",", " or ");
  }

  template <class Options>
  static std::string names(const char* condition, const Options& options) {
    std::string text;
    for (const CLI::Option* option : options) text += (text.empty() ? " " : " and ") + option->get_name();
    return text.empty() ? "" : condition + text;
  }
};

}  // namespace corbot::client
