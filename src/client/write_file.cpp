// SPDX-License-Identifier: Apache-2.0
#include "client/write_file.h"

#include <cerrno>
#include <filesystem>
#include <fstream>

#include "client/failure.h"

namespace corbot::client {
namespace {

namespace fs = std::filesystem;

/// Returns the errno of the failure, or 0.
int write_to(const fs::path& file, std::string_view text) {
  errno = 0;
  std::ofstream stream(file, std::ios::binary | std::ios::trunc);
  stream << text;
  stream.close();
  if (stream) return 0;
  return errno != 0 ? errno : EIO;
}

}  // namespace

void write_file(const std::string& file, std::string_view text) {
  std::error_code error;
  const fs::path target = fs::is_symlink(file, error) ? fs::weakly_canonical(file, error) : fs::path(file);
  const bool is_plain = !fs::exists(target, error) || fs::is_regular_file(target, error);
  const fs::path fresh = is_plain ? fs::path(target.string() + ".new") : target;
  int failed = write_to(fresh, text);
  if (failed == 0 && is_plain) {
    fs::rename(fresh, target, error);
    failed = error.value();
  }
  if (failed == 0) return;
  if (is_plain) fs::remove(fresh, error);
  throw system_failure(file, failed);
}

}  // namespace corbot::client
