// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <optional>
#include <string>

// Small files of this user in the state directory. Nothing here is real-time safe.

namespace corbot {

/// Returns the content, at most `most` bytes and one more, or nothing if there is no such file. Throws
/// std::runtime_error with the file's name if the file is unreadable, is no regular file of this user, or is
/// writable by other users.
[[nodiscard]] std::optional<std::string> read_private(const std::filesystem::path& file, std::size_t most);

/// Replaces the file atomically: a reader always finds the old or the new file, complete. `fresh` is beside
/// it, and no other process writes there. Creates the directory with mode 0700. Throws std::system_error.
void replace_private(const std::filesystem::path& file, const std::filesystem::path& fresh,
                     const std::string& text);

/// Makes the file empty if possible, which needs no space. Creates the file if there is none. Afterwards no
/// reader takes its old content for true.
void empty_private(const std::filesystem::path& file) noexcept;

/// Removes the file durably, also across a power-down; no effect if there is none. Throws std::system_error.
void remove_private(const std::filesystem::path& file);

/// Returns true if a robot can have this name, which becomes a part of a file name.
[[nodiscard]] bool is_file_name(const std::string& robot);

}  // namespace corbot
