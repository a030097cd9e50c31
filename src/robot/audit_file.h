// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <filesystem>
#include <functional>
#include <string>

#include "shm/descriptor.h"

namespace corbot {

/// The file NAME.audit, to which append() adds whole lines. At `largest` bytes the file becomes NAME.1.audit,
/// NAME.1.audit becomes NAME.2.audit, and so on up to `files` files. The class deletes the oldest file. No
/// written line gets lost for lack of a name or of space. A file that cannot be renamed grows, and append()
/// removes a line that did not fit. Not thread-safe.
class AuditFile {
 public:
  using Report = std::function<void(const std::string&)>;

  /// Opens or creates the file with mode 0600. Throws std::system_error. Calls `report` if the file cannot be
  /// rotated.
  AuditFile(std::filesystem::path file, std::size_t largest, std::size_t files, Report report);

  /// Appends a line. Throws std::system_error if the line could not be written; the file then does not
  /// contain the line.
  void append(const std::string& line);
  /// Returns true if the file ends in the middle of a line. The next append() ends that line.
  [[nodiscard]] bool is_torn() const noexcept { return is_torn_; }

 private:
  [[nodiscard]] std::filesystem::path name_of(std::size_t age) const;
  /// Returns 0, or errno.
  [[nodiscard]] int open();
  void rotate();
  void write(const std::string& text);

  const std::filesystem::path file_;
  const std::size_t largest_;
  const std::size_t files_;
  const Report report_;
  Descriptor fd_;
  bool is_regular_{false};
  bool is_torn_{false};
  std::size_t size_{0};
};

}  // namespace corbot
