// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <optional>
#include <string>

// Small files of this user in the state directory. Nothing here is real-time safe.

namespace corbot {

/// What is in it, `most` bytes and one more at the most; nothing when there is no such file. Throws std::runtime_error, with
/// its name, for one that cannot be read, that is no regular file of this user, or that others may write to.
[[nodiscard]] std::optional<std::string> read_private(const std::filesystem::path& file, std::size_t most);

/// Replaces the file: whatever happens meanwhile, a reader finds the old or the new one, whole. `fresh` is beside it, and no
/// other process writes there. Makes the directory, mode 0700. Throws std::system_error.
void replace_private(const std::filesystem::path& file, const std::filesystem::path& fresh,
                     const std::string& text);

/// For good, a power-down included; no effect when there is none. Throws std::system_error.
void remove_private(const std::filesystem::path& file);

/// Whether a robot can have this name, which becomes a part of a file's.
[[nodiscard]] bool is_file_name(const std::string& robot);

}  // namespace corbot
