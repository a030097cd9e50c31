// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <filesystem>
#include <string>
#include <string_view>

#include "config/profile.h"

namespace corbot {

inline constexpr std::size_t kMaxProfileBytes = 1u << 20;

/// Reads and checks a profile. Throws ConfigError, also when the file cannot be read.
[[nodiscard]] Profile load_profile(const std::filesystem::path& path);

/// The text of a profile, to be given to parse_profile(). Throws ConfigError.
[[nodiscard]] std::string read_profile_text(const std::filesystem::path& path);

/// The same from text; `file` names it in messages.
[[nodiscard]] Profile parse_profile(std::string_view text, std::string file);

}  // namespace corbot
