// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <map>
#include <string>
#include <string_view>

namespace corbot::panel {

/// The files of a page, read once into memory. A request opens no file, and so reads none outside the
/// directory.
class PageFiles {
 public:
  struct File {
    const char* type;  ///< MIME
    std::string bytes;
  };

  /// Reads all regular files beneath `directory`, except links and hidden entries. Throws client::Failure.
  explicit PageFiles(const std::filesystem::path& directory);

  /// `path` is the path of a URL, without the query; "/" means "/index.html". Returns null if there is no
  /// such file.
  [[nodiscard]] const File* find(std::string_view path) const;

 private:
  std::map<std::string, File, std::less<>> files_;
};

}  // namespace corbot::panel
