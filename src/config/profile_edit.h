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

/// The text of a profile with the numbers changed and every other byte as it was: comments, order, blanks.
/// Throws std::runtime_error when the text is not TOML or has no number at a path.
[[nodiscard]] std::string edit_numbers(std::string_view text, std::span<const NumberEdit> edits);

/// The text of a profile that needs no other file: where its URDF stands in one, that file's text takes the place of its path, on
/// the same line. `file`: the profile's. Throws std::runtime_error.
[[nodiscard]] std::string with_urdf_text(std::string_view text, const std::string& file);

/// What has changed, line by line, as "-old" and "+new" under the number of the line; empty: nothing.
[[nodiscard]] std::string changed_lines(std::string_view before, std::string_view after);

/// The file to replace: where `file` is a symbolic link, what it leads to, so that the link stays one.
/// Throws std::system_error.
[[nodiscard]] std::string link_target(const std::string& file);

/// Replaces the file at once by one of the same permissions, the old one as FILE.bak.
/// Throws std::system_error.
void replace_file(const std::string& file, const std::string& before, const std::string& after);

}  // namespace corbot
