// SPDX-License-Identifier: Apache-2.0
#include "sim/devices/unix_listener.h"

#include <poll.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <stdexcept>
#include <utility>

namespace corbot::sim {
namespace {

constexpr int kMostWaiting = 8;

[[noreturn]] void fail(const std::string& path, const std::string& why) {
  throw std::runtime_error(path + ": " + why);
}

/// Removes the socket of a program that was killed: it has no listener.
void remove_dead_socket(const std::string& path, int type, const sockaddr_un& address) {
  struct stat there {};
  if (::lstat(path.c_str(), &there) != 0) return;
  if (!S_ISSOCK(there.st_mode)) fail(path, "is no socket");
  const int probe = ::socket(AF_UNIX, type | SOCK_NONBLOCK | SOCK_CLOEXEC, 0);
  const bool is_dead = probe >= 0 &&
                       ::connect(probe, reinterpret_cast<const sockaddr*>(&address), sizeof(address)) != 0 &&
                       errno == ECONNREFUSED;
  if (probe >= 0) ::close(probe);
  if (!is_dead) fail(path, "another program has it open");
  (void)::unlink(path.c_str());
}

}  // namespace

UnixListener::UnixListener(std::string path, int type, std::optional<mode_t> mode) : path_(std::move(path)) {
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  constexpr std::size_t kLongest = sizeof(address.sun_path) - 1;
  if (path_.empty() || path_.size() > kLongest) {
    fail(path_, "the path of a socket has 1 to " + std::to_string(kLongest) + " bytes, this one " +
                    std::to_string(path_.size()));
  }
  path_.copy(address.sun_path, path_.size());
  remove_dead_socket(path_, type, address);
  fd_ = ::socket(AF_UNIX, type | SOCK_NONBLOCK | SOCK_CLOEXEC, 0);
  // The file gets the socket's mode, so that it never has a wider one.
  const bool is_bound = fd_ >= 0 && (!mode || ::fchmod(fd_, *mode) == 0) &&
                        ::bind(fd_, reinterpret_cast<const sockaddr*>(&address), sizeof(address)) == 0;
  struct stat made {};
  if (is_bound && ::stat(path_.c_str(), &made) == 0) inode_ = made.st_ino;
  if (is_bound && ::listen(fd_, kMostWaiting) == 0) return;
  const std::string why = std::strerror(errno);
  if (is_bound) (void)::unlink(path_.c_str());
  if (fd_ >= 0) ::close(fd_);
  fail(path_, why);
}

UnixListener::~UnixListener() {
  ::close(fd_);
  struct stat there {};
  if (::stat(path_.c_str(), &there) == 0 && there.st_ino == inode_) (void)::unlink(path_.c_str());
}

int UnixListener::accept() const {
  // Linux makes the new socket before it looks for a client, which takes several times as long as poll.
  pollfd waiting{fd_, POLLIN, 0};
  if (::poll(&waiting, 1, 0) != 1) return -1;
  return ::accept4(fd_, nullptr, nullptr, SOCK_NONBLOCK | SOCK_CLOEXEC);
}

}  // namespace corbot::sim
