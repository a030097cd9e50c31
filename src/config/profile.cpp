// SPDX-License-Identifier: Apache-2.0
#include "config/profile.h"

#include <algorithm>
#include <utility>

#include <fmt/format.h>

namespace corbot {
namespace {

std::string joined(const std::vector<ConfigFault>& faults) {
  std::string text;
  for (const ConfigFault& fault : faults) text += (text.empty() ? "" : "\n") + fault.text();
  return text;
}

}  // namespace

bool is_name(std::string_view text) {
  return !text.empty() && text.size() <= kMaxNameLength && std::all_of(text.begin(), text.end(), [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_' || c == '-';
  });
}

std::string name_rule() { return fmt::format("1 to {} ASCII letters, digits, '_' or '-'", kMaxNameLength); }

std::string ConfigFault::text() const {
  std::string where = line == 0 ? file : fmt::format("{}:{}", file, line);
  const std::string named = name.empty() ? key : fmt::format("{} ({})", key, name);
  if (!key.empty() && !value.empty()) return fmt::format("{}: {} = {}: {}", where, named, value, allowed);
  if (!key.empty()) return fmt::format("{}: {}: {}", where, named, allowed);
  return fmt::format("{}: {}", where, allowed);
}

ConfigError::ConfigError(std::vector<ConfigFault> faults)
    : std::runtime_error{joined(faults)}, faults_{std::move(faults)} {}

bool unpowered_after_exit(const Profile& profile) {
  const BackendOptions& backend = profile.backend;
  return backend.kind == "gpiod" || switches_power(profile) || backend.common.relax_at_end;
}

bool switches_power(const Profile& profile) {
  return !profile.power_enable.chip.empty() || !profile.watchdog.chip.empty();
}

}  // namespace corbot
