// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <map>
#include <string>
#include <string_view>

namespace corbot::panel {

/// The files of a page, read once: a request opens no file, so none outside the directory can be had.
class PageFiles {
 public:
  struct File {
    const char* type;  ///< MIME
    std::string bytes;
  };

  /// Reads all regular files beneath `directory`, but hidden ones and links. Throws client::Failure.
  explicit PageFiles(const std::filesystem::path& directory);

  /// `path` is of a URL, without a query; "/" is "/index.html". Null where there is no such file.
  [[nodiscard]] const File* find(std::string_view path) const;

 private:
  std::map<std::string, File, std::less<>> files_;
};

}  // namespace corbot::panel
