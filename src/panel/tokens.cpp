// SPDX-License-Identifier: Apache-2.0
#include "panel/tokens.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/file.h>
#include <sys/random.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <utility>

#include "client/failure.h"

namespace corbot::panel {

namespace {

using client::ExitCode;
using client::Failure;

std::string new_token() {
  std::array<unsigned char, 16> bytes{};
  if (::getrandom(bytes.data(), bytes.size(), 0) != static_cast<ssize_t>(bytes.size()))
    throw Failure(ExitCode::kInternal, "the kernel gives no random numbers for the tokens");
  std::string token;
  for (const unsigned char byte : bytes) token += fmt::format("{:02x}", byte);
  return token;
}

}  // namespace

Tokens new_tokens() { return {new_token(), new_token()}; }

TokenFile::TokenFile(std::filesystem::path path, const Tokens& tokens)
    : path_(std::move(path)),
      fd_(::open(path_.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC | O_NOFOLLOW, 0600)) {
  if (fd_ < 0 && errno == EEXIST)
    throw Failure(ExitCode::kUsage,
                  path_.string() + ": exists already: remove it, or name another file with --token-file");
  if (fd_ < 0) throw client::system_failure(path_, errno);
  const std::string text = fmt::format("watch {}\ndrive {}\n", tokens.watch, tokens.drive);
  if (::flock(fd_, LOCK_EX | LOCK_NB) == 0 &&
      ::write(fd_, text.data(), text.size()) == static_cast<ssize_t>(text.size()))
    return;
  const int error = errno;
  ::close(fd_);
  ::unlink(path_.c_str());
  throw client::system_failure(path_, error);
}

TokenFile::~TokenFile() {
  ::unlink(path_.c_str());
  ::close(fd_);
}

void TokenFile::remove_stale(const std::filesystem::path& path) {
  const int fd = ::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NOFOLLOW | O_NONBLOCK);
  if (fd < 0) return;
  if (::flock(fd, LOCK_EX | LOCK_NB) == 0) ::unlink(path.c_str());
  ::close(fd);
}

}  // namespace corbot::panel
