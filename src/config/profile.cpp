// SPDX-License-Identifier: Apache-2.0
#include "config/profile.h"

#include <algorithm>
#include <fstream>
#include <system_error>
#include <utility>

#include <fmt/format.h>
#include <toml++/toml.h>

#include "config/schema.h"

namespace corbot {
namespace {

std::string joined(const std::vector<ConfigFault>& faults) {
  std::string text;
  for (const ConfigFault& fault : faults) text += (text.empty() ? "" : "\n") + fault.text();
  return text;
}

[[noreturn]] void refuse_file(const std::string& file, std::string why) {
  throw ConfigError{{ConfigFault{file, 0, "", "", std::move(why)}}};
}

std::string read_text(const std::filesystem::path& path) {
  std::error_code error;
  const auto status = std::filesystem::status(path, error);
  if (status.type() == std::filesystem::file_type::not_found) refuse_file(path.string(), "no such file");
  if (error) refuse_file(path.string(), "cannot be read: " + error.message());
  if (!std::filesystem::is_regular_file(status)) refuse_file(path.string(), "is not a file");
  std::ifstream stream{path, std::ios::binary};
  if (!stream) refuse_file(path.string(), "cannot be opened: check its permissions");
  // One byte more than allowed, so that parse_profile sees when there is too much.
  std::string text(kMaxProfileBytes + 1, '\0');
  stream.read(text.data(), static_cast<std::streamsize>(text.size()));
  if (stream.bad()) refuse_file(path.string(), "cannot be read");
  text.resize(static_cast<std::size_t>(stream.gcount()));
  return text;
}

}  // namespace

std::string ConfigFault::text() const {
  std::string where = line == 0 ? file : fmt::format("{}:{}", file, line);
  if (!key.empty() && !value.empty()) return fmt::format("{}: {} = {}: {}", where, key, value, allowed);
  if (!key.empty()) return fmt::format("{}: {}: {}", where, key, allowed);
  return fmt::format("{}: {}", where, allowed);
}

ConfigError::ConfigError(std::vector<ConfigFault> faults)
    : std::runtime_error{joined(faults)}, faults_{std::move(faults)} {}

Profile load_profile(const std::filesystem::path& path) {
  return parse_profile(read_text(path), path.string());
}

Profile parse_profile(std::string_view text, std::string file) {
  if (text.size() > kMaxProfileBytes)
    refuse_file(file, fmt::format("is larger than {} bytes", kMaxProfileBytes));
  Profile profile;
  profile.file = file;
  FaultList faults{std::move(file), {}};
  try {
    const toml::table root = toml::parse(text, faults.file);
    read_schema(root, profile, faults);
  } catch (const toml::parse_error& error) {
    faults.add(static_cast<std::uint32_t>(error.source().begin.line), "", "",
               fmt::format("not TOML: {}", error.description()));
  }
  if (faults.faults.empty()) return profile;
  std::stable_sort(faults.faults.begin(), faults.faults.end(),
                   [](const ConfigFault& a, const ConfigFault& b) { return a.line < b.line; });
  throw ConfigError{std::move(faults.faults)};
}

bool unpowered_after_exit(const Profile& profile) {
  const BackendOptions& backend = profile.backend;
  if (backend.kind == "gpiod" || !profile.power_enable.chip.empty()) return true;
  if (backend.kind == "pca9685") return backend.pca9685.relax_at_end;
  if (backend.kind == "pwm_sysfs") return backend.pwm_sysfs.relax_at_end;
  if (backend.kind == "socketcan") return backend.socketcan.relax_at_end;
  return backend.serial.relax_at_end;
}

}  // namespace corbot
