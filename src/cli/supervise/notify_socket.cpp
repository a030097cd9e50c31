// SPDX-License-Identifier: Apache-2.0
#include "cli/supervise/notify_socket.h"

#include <fmt/format.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>

#include <array>
#include <cerrno>
#include <cstring>
#include <string_view>
#include <utility>

#include "client/failure.h"

namespace corbot::cli {

using client::ExitCode;
using client::Failure;
using client::system_failure;

namespace {

constexpr std::size_t kMaxMessage = 4096;
constexpr std::size_t kMaxDescriptors = 253;  // the kernel's SCM_MAX_FD

/// Takes the ancillary data of a message. Returns false if a part was cut off.
bool read_ancillary(msghdr& message, Notification& out) {
  for (cmsghdr* part = CMSG_FIRSTHDR(&message); part != nullptr; part = CMSG_NXTHDR(&message, part)) {
    if (part->cmsg_level != SOL_SOCKET) continue;
    if (part->cmsg_type == SCM_RIGHTS) {
      const std::size_t count = (part->cmsg_len - CMSG_LEN(0)) / sizeof(int);
      for (std::size_t i = 0; i < count; ++i) {
        int fd = -1;
        std::memcpy(&fd, CMSG_DATA(part) + i * sizeof(int), sizeof(int));
        out.descriptors.emplace_back(fd);
      }
    } else if (part->cmsg_type == SCM_CREDENTIALS) {
      ucred credentials{};
      std::memcpy(&credentials, CMSG_DATA(part), sizeof(credentials));
      out.sender = credentials.pid;
    }
  }
  return (message.msg_flags & (MSG_TRUNC | MSG_CTRUNC)) == 0;
}

}  // namespace

Notification parse_notification(std::string_view text) {
  Notification out;
  while (!text.empty()) {
    const std::size_t end = std::min(text.find('\n'), text.size());
    const std::string_view line = text.substr(0, end);
    text.remove_prefix(std::min(end + 1, text.size()));
    const std::size_t equals = line.find('=');
    if (equals == std::string_view::npos) continue;
    const std::string_view key = line.substr(0, equals);
    const std::string_view value = line.substr(equals + 1);
    if (key == "READY") out.ready = value == "1";
    if (key == "WATCHDOG") out.watchdog = value == "1";
    if (key == "FDSTORE") out.store = value == "1";
    if (key == "FDSTOREREMOVE") out.remove = value == "1";
    if (key == "FDNAME") out.fd_name = value;
    if (key == "STATUS") out.status = std::string(value);
  }
  return out;
}

NotifySocket::NotifySocket(std::string path) : path_(std::move(path)) { open(); }

NotifySocket::~NotifySocket() {
  struct stat status {};
  if (::lstat(path_.c_str(), &status) == 0 && status.st_dev == device_ && status.st_ino == inode_)
    ::unlink(path_.c_str());
}

void NotifySocket::open() {
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  if (path_.size() >= sizeof(address.sun_path)) {
    throw Failure(ExitCode::kInternal, fmt::format("{}: the path is longer than the {} bytes of a socket's "
                                                   "path: set XDG_RUNTIME_DIR to a shorter directory",
                                                   path_, sizeof(address.sun_path) - 1));
  }
  std::memcpy(address.sun_path, path_.data(), path_.size());
  Descriptor fd(::socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0));
  const int on = 1;
  if (fd.get() < 0 || ::setsockopt(fd.get(), SOL_SOCKET, SO_PASSCRED, &on, sizeof(on)) != 0)
    throw system_failure(path_, errno);
  ::unlink(path_.c_str());  // left by a supervisor that died; the lock beside it proves that none lives
  struct stat status {};
  if (::bind(fd.get(), reinterpret_cast<const sockaddr*>(&address), sizeof(address)) != 0 ||
      ::chmod(path_.c_str(), 0600) != 0 || ::lstat(path_.c_str(), &status) != 0) {
    throw system_failure(path_, errno);
  }
  device_ = status.st_dev;
  inode_ = status.st_ino;
  fd_ = std::move(fd);
}

void NotifySocket::restore() {
  struct stat status {};
  if (::lstat(path_.c_str(), &status) == 0 && status.st_dev == device_ && status.st_ino == inode_) return;
  open();
}

std::optional<Notification> NotifySocket::receive() {
  for (;;) {
    std::array<char, kMaxMessage> text{};
    alignas(cmsghdr) std::array<char, CMSG_SPACE(sizeof(ucred)) + CMSG_SPACE(kMaxDescriptors * sizeof(int))>
        control{};
    iovec part{text.data(), text.size()};
    msghdr message{};
    message.msg_iov = &part;
    message.msg_iovlen = 1;
    message.msg_control = control.data();
    message.msg_controllen = control.size();
    const ssize_t size = ::recvmsg(fd_.get(), &message, MSG_DONTWAIT | MSG_CMSG_CLOEXEC);
    if (size < 0 && errno == EINTR) continue;
    if (size < 0) return std::nullopt;
    Notification envelope;
    if (!read_ancillary(message, envelope) || envelope.sender <= 0) continue;
    Notification out = parse_notification({text.data(), static_cast<std::size_t>(size)});
    out.sender = envelope.sender;
    out.descriptors = std::move(envelope.descriptors);
    return out;
  }
}

}  // namespace corbot::cli
