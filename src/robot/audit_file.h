// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <filesystem>
#include <functional>
#include <string>

#include "shm/descriptor.h"

namespace corbot {

/// NAME.audit, to which whole lines are appended. At `largest` bytes it becomes NAME.1.audit, that NAME.2.audit, and so on
/// up to `files` of them; the oldest is deleted. What has been written is never lost for want of a name or of room: a
/// file that cannot be renamed grows, and a line that did not fit is taken back. One thread at a time.
class AuditFile {
 public:
  using Report = std::function<void(const std::string&)>;

  /// Opens it, or makes it, mode 0600. Throws std::system_error. `report` is called when it cannot be rotated.
  AuditFile(std::filesystem::path file, std::size_t largest, std::size_t files, Report report);

  /// Throws std::system_error: the line is not there.
  void append(const std::string& line);
  /// It ends in the middle of a line, which append() ends.
  [[nodiscard]] bool is_torn() const noexcept { return is_torn_; }

 private:
  [[nodiscard]] std::filesystem::path name_of(std::size_t age) const;
  /// 0, or errno.
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
