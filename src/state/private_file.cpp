// SPDX-License-Identifier: Apache-2.0
#include "state/private_file.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <stdexcept>
#include <system_error>

namespace corbot {
namespace {

namespace fs = std::filesystem;

[[noreturn]] void throw_system(const fs::path& path, int error) {
  throw std::system_error(error, std::generic_category(), path.string());
}

/// A file descriptor that closes automatically.
class Descriptor {
 public:
  explicit Descriptor(int fd) : fd_(fd) {}
  Descriptor(const Descriptor&) = delete;
  Descriptor& operator=(const Descriptor&) = delete;
  ~Descriptor() {
    if (fd_ >= 0) ::close(fd_);
  }
  [[nodiscard]] int get() const noexcept { return fd_; }

 private:
  int fd_;
};

void write_all(int fd, const std::string& text, const fs::path& path) {
  for (std::size_t done = 0; done < text.size();) {
    const ssize_t n = ::write(fd, text.data() + done, text.size() - done);
    if (n < 0 && errno == EINTR) continue;
    if (n < 0) throw_system(path, errno);
    done += static_cast<std::size_t>(n);
  }
  if (::fsync(fd) != 0) throw_system(path, errno);
}

Descriptor open_directory(const fs::path& directory) {
  return Descriptor(::open(directory.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
}

}  // namespace

std::optional<std::string> read_private(const fs::path& file, std::size_t most) {
  // O_NONBLOCK: a pipe in its place must not block the start.
  const Descriptor opened(::open(file.c_str(), O_RDONLY | O_CLOEXEC | O_NOFOLLOW | O_NONBLOCK));
  if (opened.get() < 0) {
    if (errno == ENOENT || errno == ENOTDIR) return std::nullopt;
    throw std::runtime_error(file.string() + ": " + std::strerror(errno));
  }
  struct stat status {};
  if (::fstat(opened.get(), &status) != 0)
    throw std::runtime_error(file.string() + ": " + std::strerror(errno));
  if (!S_ISREG(status.st_mode) || status.st_uid != ::geteuid() || (status.st_mode & 0022) != 0)
    throw std::runtime_error(file.string() + ": is not a file of yours that only you may write");
  std::string text(most + 1, '\0');
  const ssize_t n = ::read(opened.get(), text.data(), text.size());
  if (n < 0) throw std::runtime_error(file.string() + ": " + std::strerror(errno));
  text.resize(static_cast<std::size_t>(n));
  return text;
}

void replace_private(const fs::path& file, const fs::path& fresh, const std::string& text) {
  const fs::path directory = file.parent_path();
  std::error_code error;
  fs::create_directories(directory.parent_path(), error);  // the next call reports a fault
  if (::mkdir(directory.c_str(), 0700) != 0 && errno != EEXIST) throw_system(directory, errno);
  const Descriptor parent = open_directory(directory);
  if (parent.get() < 0) throw_system(directory, errno);
  try {
    const Descriptor opened(
        ::open(fresh.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC | O_NOFOLLOW, 0600));
    if (opened.get() < 0) throw_system(fresh, errno);
    write_all(opened.get(), text, fresh);
    if (::rename(fresh.c_str(), file.c_str()) != 0) throw_system(file, errno);
  } catch (const std::system_error&) {
    ::unlink(fresh.c_str());  // frees its bytes on a full disk
    throw;
  }
  if (::fsync(parent.get()) != 0) throw_system(directory, errno);
}

void empty_private(const fs::path& file) noexcept {
  const Descriptor opened(
      ::open(file.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC | O_NOFOLLOW | O_NONBLOCK, 0600));
  if (opened.get() >= 0) (void)::fsync(opened.get());
}

void remove_private(const fs::path& file) {
  const Descriptor parent = open_directory(file.parent_path());  // first: its failure removes nothing
  if (parent.get() < 0 && (errno == ENOENT || errno == ENOTDIR)) return;
  if (parent.get() < 0) throw_system(file.parent_path(), errno);
  if (::unlink(file.c_str()) != 0) {
    if (errno == ENOENT) return;
    throw_system(file, errno);
  }
  if (::fsync(parent.get()) != 0) throw_system(file.parent_path(), errno);
}

bool is_file_name(const std::string& text) {
  return !text.empty() && text.size() <= 48 && std::all_of(text.begin(), text.end(), [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_' || c == '-';
  });
}

}  // namespace corbot
