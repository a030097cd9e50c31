// SPDX-License-Identifier: Apache-2.0
#include "panel/page_files.h"

#include <array>
#include <fstream>
#include <iterator>
#include <utility>

#include "client/failure.h"

namespace corbot::panel {

namespace {

namespace fs = std::filesystem;
using client::ExitCode;
using client::Failure;

constexpr std::size_t kMostBytes = 64U << 20U;

const char* mime_type(const std::string& extension) {
  constexpr std::array<std::pair<std::string_view, const char*>, 10> kTypes{
      {{".html", "text/html; charset=utf-8"},
       {".js", "text/javascript; charset=utf-8"},
       {".css", "text/css; charset=utf-8"},
       {".json", "application/json"},
       {".map", "application/json"},
       {".svg", "image/svg+xml"},
       {".png", "image/png"},
       {".ico", "image/x-icon"},
       {".woff2", "font/woff2"},
       {".txt", "text/plain; charset=utf-8"}}};
  for (const auto& [known, type] : kTypes) {
    if (extension == known) return type;
  }
  return "application/octet-stream";
}

bool is_hidden(const fs::path& path) { return path.filename().string().starts_with('.'); }

std::string bytes_of(const fs::path& path) {
  std::ifstream stream(path, std::ios::binary);
  std::string bytes{std::istreambuf_iterator<char>(stream), {}};
  if (stream.bad() || !stream.is_open())
    throw Failure(ExitCode::kInternal, path.string() + ": cannot be read");
  return bytes;
}

}  // namespace

PageFiles::PageFiles(const fs::path& directory) {
  std::size_t total = 0;
  try {
    for (auto entry = fs::recursive_directory_iterator(directory); entry != fs::end(entry); ++entry) {
      if (is_hidden(entry->path())) {
        entry.disable_recursion_pending();
      } else if (entry->symlink_status().type() == fs::file_type::regular) {
        total += entry->file_size();
        if (total > kMostBytes)
          throw Failure(ExitCode::kUsage, directory.string() + ": more than 64 MB are no page");
        files_.emplace("/" + entry->path().lexically_relative(directory).generic_string(),
                       File{mime_type(entry->path().extension().string()), bytes_of(entry->path())});
      }
    }
  } catch (const fs::filesystem_error& error) {
    throw Failure(ExitCode::kInternal, directory.string() + ": " + error.code().message());
  }
}

const PageFiles::File* PageFiles::find(std::string_view path) const {
  const auto found = files_.find(path == "/" ? "/index.html" : path);
  return found == files_.end() ? nullptr : &found->second;
}

}  // namespace corbot::panel
