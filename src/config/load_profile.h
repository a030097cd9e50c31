// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <filesystem>
#include <string>
#include <string_view>

#include "config/profile.h"

namespace corbot {

inline constexpr std::size_t kMaxProfileBytes = 1u << 20;

/// Reads and checks a profile. Throws ConfigError, also if the file cannot be read.
[[nodiscard]] Profile load_profile(const std::filesystem::path& path);

/// Returns the text of a profile for parse_profile(). Throws ConfigError.
[[nodiscard]] std::string read_profile_text(const std::filesystem::path& path);

/// Parses and checks a profile's text; messages call it `file`.
[[nodiscard]] Profile parse_profile(std::string_view text, std::string file);

}  // namespace corbot
