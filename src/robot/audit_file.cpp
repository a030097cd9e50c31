// SPDX-License-Identifier: Apache-2.0
#include "robot/audit_file.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <system_error>
#include <utility>

namespace corbot {
namespace {

namespace fs = std::filesystem;

[[noreturn]] void throw_system(const fs::path& file, int error) {
  throw std::system_error(error, std::generic_category(), file.string());
}

bool ends_in_mid_line(const fs::path& file, std::size_t size) {
  const Descriptor fd(::open(file.c_str(), O_RDONLY | O_CLOEXEC));
  char last = '\n';
  if (size > 0) (void)!::pread(fd.get(), &last, 1, static_cast<off_t>(size - 1));
  return last != '\n';
}

}  // namespace

AuditFile::AuditFile(fs::path file, std::size_t largest, std::size_t files, Report report)
    : file_(std::move(file)), largest_(largest), files_(files), report_(std::move(report)) {
  if (const int error = open(); error != 0) throw_system(file_, error);
}

fs::path AuditFile::name_of(std::size_t age) const {
  if (age == 0) return file_;
  return file_.parent_path() / fmt::format("{}.{}{}", file_.stem().string(), age, file_.extension().string());
}

int AuditFile::open() {
  Descriptor fd(::open(file_.c_str(), O_WRONLY | O_APPEND | O_CREAT | O_CLOEXEC, 0600));
  struct stat status {};
  if (fd.get() < 0 || ::fstat(fd.get(), &status) != 0) return errno;
  is_regular_ = S_ISREG(status.st_mode);
  size_ = is_regular_ ? static_cast<std::size_t>(status.st_size) : 0;
  if (is_regular_) (void)::fchmod(fd.get(), 0600);
  is_torn_ = is_regular_ && ends_in_mid_line(file_, size_);
  fd_ = std::move(fd);
  return 0;
}

void AuditFile::append(const std::string& line) {
  if (is_regular_ && size_ > 0 && size_ + line.size() + 2 > largest_) rotate();
  write((is_torn_ ? "\n" : "") + line + '\n');
}

void AuditFile::rotate() {
  // The renaming goes no further than the first free name: an earlier failure has left a gap there.
  std::size_t last = 1;
  while (last + 1 < files_ && ::access(name_of(last).c_str(), F_OK) == 0) ++last;
  for (std::size_t age = last; age > 0; --age) {
    if (::rename(name_of(age - 1).c_str(), name_of(age).c_str()) == 0 || errno == ENOENT) continue;
    return report_(fmt::format("cannot be rotated and grows: {}: {}", name_of(age - 1).filename().string(),
                               std::strerror(errno)));
  }
  if (const int error = open(); error != 0) {
    (void)::rename(name_of(1).c_str(), file_.c_str());  // the descriptor is still open
    report_(
        fmt::format("cannot be rotated and grows: {}: {}", file_.filename().string(), std::strerror(error)));
  }
}

void AuditFile::write(const std::string& text) {
  for (std::size_t done = 0; done < text.size();) {
    const ssize_t written = ::write(fd_.get(), text.data() + done, text.size() - done);
    if (written < 0 && errno == EINTR) continue;
    if (written < 0) {
      const int error = errno;
      is_torn_ = is_torn_ || (done > 0 && ::ftruncate(fd_.get(), static_cast<off_t>(size_)) != 0);
      throw_system(file_, error);
    }
    done += static_cast<std::size_t>(written);
  }
  is_torn_ = false;
  if (is_regular_) size_ += text.size();
}

}  // namespace corbot
