// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <string>
#include <string_view>

namespace corbot {

/// One number of a profile: its path, "joint[2].servo.zero_us" or "joint[2].range_deg[0]", and its new value.
struct NumberEdit {
  std::string path;
  double value{};
};

/// Returns the text of a profile with the numbers changed and every other byte unchanged: comments, order,
/// blanks. Throws std::runtime_error if the text is not TOML or has no number at a path.
[[nodiscard]] std::string edit_numbers(std::string_view text, std::span<const NumberEdit> edits);

/// Returns the text of a profile that needs no other file. If its URDF is in a file, that file's text
/// replaces the path, on the same line. `file`: the profile's name. Throws std::runtime_error.
[[nodiscard]] std::string with_urdf_text(std::string_view text, const std::string& file);

/// Returns the changes line by line, as "-old" and "+new" under the number of the line; "" if there are none.
[[nodiscard]] std::string changed_lines(std::string_view before, std::string_view after);

/// Returns the file to replace. If `file` is a symbolic link, that is its target, so that the link remains.
/// Throws std::system_error.
[[nodiscard]] std::string link_target(const std::string& file);

/// Replaces the file atomically by one with the same permissions, and keeps the old one as FILE.bak. Throws
/// std::system_error.
void replace_file(const std::string& file, const std::string& before, const std::string& after);

}  // namespace corbot
