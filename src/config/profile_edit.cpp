// SPDX-License-Identifier: Apache-2.0
#include "config/profile_edit.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <filesystem>
#include <stdexcept>
#include <system_error>
#include <vector>

#include <fmt/format.h>
#include <toml++/toml.h>

#include "config/geometry_schema.h"

namespace corbot {
namespace {

/// A range of bytes in a text: [begin, end).
struct Extent {
  std::size_t begin{};
  std::size_t end{};
};

/// Returns the offset of a line and a column as the parser counts them: from 1, one column for each code
/// point.
std::size_t offset_of(std::string_view text, const toml::source_position& at) {
  // the parser does not count the byte-order mark
  std::size_t offset = text.starts_with("\xef\xbb\xbf") ? 3 : 0;
  for (toml::source_index line = 1; line < at.line; ++line) offset = text.find('\n', offset) + 1;
  for (toml::source_index column = 1; column < at.column && offset < text.size(); ++column) {
    ++offset;
    while (offset < text.size() && (static_cast<unsigned char>(text[offset]) & 0xc0) == 0x80) ++offset;
  }
  return offset;
}

bool is_of_number(char c) {
  return (c >= '0' && c <= '9') || (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || c == '+' || c == '-' ||
         c == '.' || c == '_';
}

Extent extent_of(std::string_view text, const toml::table& root, const std::string& path) {
  const auto found = toml::at_path(root, path);
  if (!found.is_number()) throw std::runtime_error(fmt::format("{}: there is no such number", path));
  const std::size_t begin = offset_of(text, found.node()->source().begin);
  std::size_t end = begin;
  while (end < text.size() && is_of_number(text[end])) ++end;
  if (end == begin) throw std::runtime_error(fmt::format("{}: cannot be found in the text", path));
  return {begin, end};
}

toml::table parse(std::string_view text) {
  try {
    return toml::parse(text);
  } catch (const toml::parse_error& error) {
    throw std::runtime_error(fmt::format("line {}: {}", error.source().begin.line, error.description()));
  }
}

/// Returns a TOML string on one line.
std::string toml_string(std::string_view text) {
  std::string quoted = "\"";
  for (const char c : text) {
    if (c == '"' || c == '\\') {
      quoted += {'\\', c};
    } else if (static_cast<unsigned char>(c) < 0x20 || c == 0x7f) {
      quoted += fmt::format("\\u{:04x}", static_cast<unsigned>(c));
    } else {
      quoted += c;
    }
  }
  return quoted + '"';
}

std::vector<std::string_view> lines_of(std::string_view text) {
  std::vector<std::string_view> lines;
  while (!text.empty()) {
    const std::size_t end = std::min(text.find('\n'), text.size());
    lines.push_back(text.substr(0, end));
    text.remove_prefix(std::min(end + 1, text.size()));
  }
  return lines;
}

[[noreturn]] void throw_system(const std::string& file) {
  throw std::system_error(errno, std::generic_category(), file);
}

/// Writes a new file beside `file` and renames it atomically.
void put(const std::string& file, const std::string& text, mode_t mode) {
  const std::string fresh = file + ".new";
  ::unlink(fresh.c_str());  // left by a write that was interrupted
  const int fd = ::open(fresh.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC | O_NOFOLLOW, mode);
  if (fd < 0) throw_system(fresh);
  const bool whole = ::fchmod(fd, mode) == 0 &&
                     ::write(fd, text.data(), text.size()) == static_cast<ssize_t>(text.size()) &&
                     ::fsync(fd) == 0;
  const int error = errno;
  ::close(fd);
  if (whole && ::rename(fresh.c_str(), file.c_str()) == 0) return;
  if (!whole) errno = error;
  const int cause = errno;
  ::unlink(fresh.c_str());
  errno = cause;
  throw_system(file);
}

}  // namespace

std::string edit_numbers(std::string_view text, std::span<const NumberEdit> edits) {
  const toml::table root = parse(text);
  std::vector<std::pair<Extent, double>> found;
  for (const NumberEdit& edit : edits) found.emplace_back(extent_of(text, root, edit.path), edit.value);
  // Ordered from the end, so that the offsets of earlier edits stay valid.
  std::sort(found.begin(), found.end(),
            [](const auto& a, const auto& b) { return a.first.begin > b.first.begin; });
  std::string result(text);
  for (const auto& [extent, value] : found) {
    result.replace(extent.begin, extent.end - extent.begin, fmt::format("{}", value + 0.0));
  }
  return result;
}

std::string with_urdf_text(std::string_view text, const std::string& file) {
  const toml::table root = parse(text);
  const auto* path = root["geometry"]["urdf"].as_string();
  if (path == nullptr || is_urdf_text(path->get())) return std::string(text);
  const std::string xml = read_urdf(path->get(), file);
  const toml::source_region& source = path->source();
  const std::size_t begin = offset_of(text, source.begin), end = offset_of(text, source.end);
  std::string whole = fmt::format("{}{}{}", text.substr(0, begin), toml_string(xml), text.substr(end));
  if (parse(whole)["geometry"]["urdf"].value_or(std::string{}) != xml)
    throw std::runtime_error(fmt::format("{}: geometry.urdf: cannot be copied into the profile", file));
  return whole;
}

std::string changed_lines(std::string_view before, std::string_view after) {
  const auto old_lines = lines_of(before);
  const auto new_lines = lines_of(after);
  std::string text;
  for (std::size_t i = 0; i < std::max(old_lines.size(), new_lines.size()); ++i) {
    const std::string_view old_line = i < old_lines.size() ? old_lines[i] : "";
    const std::string_view new_line = i < new_lines.size() ? new_lines[i] : "";
    if (old_line == new_line) continue;
    text += fmt::format("@@ line {}\n-{}\n+{}\n", i + 1, old_line, new_line);
  }
  return text;
}

std::string link_target(const std::string& file) {
  return std::filesystem::is_symlink(file) ? std::filesystem::canonical(file).string() : file;
}

void replace_file(const std::string& file, const std::string& before, const std::string& after) {
  struct stat status {};
  if (::stat(file.c_str(), &status) != 0) throw_system(file);
  const mode_t mode = status.st_mode & 0777;
  put(file + ".bak", before, mode);
  put(file, after, mode);
}

}  // namespace corbot
