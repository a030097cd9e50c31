// SPDX-License-Identifier: Apache-2.0
#include "shm/message.h"

#include <poll.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <type_traits>

namespace corbot {
namespace {

using Control = std::array<char, CMSG_SPACE(sizeof(int) * kCarriedAtMost)>;

template <std::size_t kSize>
void copy_text(char (&to)[kSize], std::string_view from) {
  std::memcpy(to, from.data(), std::min(from.size(), kSize - 1));
}

template <std::size_t kSize>
std::string text_of(const char (&text)[kSize]) {
  return {text, ::strnlen(text, kSize)};
}

/// Takes every received descriptor, so that none leaks, however many were announced.
void take_descriptors(msghdr& header, Message& message) {
  std::array<Descriptor, kCarriedAtMost> came;
  std::size_t count = 0;
  for (cmsghdr* part = CMSG_FIRSTHDR(&header); part != nullptr; part = CMSG_NXTHDR(&header, part)) {
    if (part->cmsg_level != SOL_SOCKET || part->cmsg_type != SCM_RIGHTS) continue;
    const std::size_t fds = (part->cmsg_len - CMSG_LEN(0)) / sizeof(int);
    for (std::size_t i = 0; i < fds; ++i) {
      int fd = -1;
      std::memcpy(&fd, CMSG_DATA(part) + i * sizeof(int), sizeof(int));
      Descriptor taken(fd);
      if (count < came.size()) came[count++] = std::move(taken);
    }
  }
  std::size_t next = 0;
  for (const auto& [which, into] :
       {std::pair{kCarriesTask, &message.task}, std::pair{kCarriesServant, &message.servant},
        std::pair{kCarriesStop, &message.stop}}) {
    if ((message.record.carries & which) != 0 && next < count) *into = std::move(came[next++]);
  }
}

}  // namespace

Message Message::make(MessageType type, std::string_view robot) {
  static_assert(std::is_trivially_copyable_v<Record>);
  Message message;
  message.record.type = type;
  copy_text(message.record.robot, robot);
  return message;
}

Message Message::refusal(std::string_view robot, const SegmentError& error) {
  Message message = make(MessageType::kRefused, robot);
  message.record.error = static_cast<std::uint32_t>(error.kind());
  copy_text(message.record.text, error.what());
  return message;
}

SegmentError Message::error() const {
  const auto kind = record.error <= static_cast<std::uint32_t>(SegmentError::Kind::kSilent)
                        ? static_cast<SegmentError::Kind>(record.error)
                        : SegmentError::Kind::kForeign;
  return {kind, text_of(record.text)};
}

std::string Message::robot() const { return text_of(record.robot); }

bool send_message(const Descriptor& connection, Message message, std::initializer_list<Carried> carried) {
  std::array<int, kCarriedAtMost> fds{};
  std::size_t count = 0;
  for (const Carried& each : carried) {
    if (each.fd < 0 || count == fds.size()) continue;
    message.record.carries |= each.which;
    fds[count++] = each.fd;
  }
  iovec bytes{&message.record, sizeof(message.record)};
  alignas(cmsghdr) Control control{};
  msghdr header{};
  header.msg_iov = &bytes;
  header.msg_iovlen = 1;
  if (count > 0) {
    header.msg_control = control.data();
    header.msg_controllen = CMSG_SPACE(sizeof(int) * count);
    cmsghdr* const part = CMSG_FIRSTHDR(&header);
    part->cmsg_level = SOL_SOCKET;
    part->cmsg_type = SCM_RIGHTS;
    part->cmsg_len = CMSG_LEN(sizeof(int) * count);
    std::memcpy(CMSG_DATA(part), fds.data(), sizeof(int) * count);
  }
  return ::sendmsg(connection.get(), &header, MSG_NOSIGNAL | MSG_DONTWAIT) ==
         static_cast<ssize_t>(sizeof(message.record));
}

Received receive_message(const Descriptor& connection, Message& message) {
  message = Message{};
  iovec bytes{&message.record, sizeof(message.record)};
  alignas(cmsghdr) Control control{};
  msghdr header{};
  header.msg_iov = &bytes;
  header.msg_iovlen = 1;
  header.msg_control = control.data();
  header.msg_controllen = control.size();
  const ssize_t got = ::recvmsg(connection.get(), &header, MSG_CMSG_CLOEXEC | MSG_DONTWAIT);
  if (got < 0) return errno == EAGAIN || errno == EINTR ? Received::kNothing : Received::kClosed;
  take_descriptors(header, message);
  const bool is_whole = got == static_cast<ssize_t>(sizeof(message.record)) &&
                        (header.msg_flags & (MSG_TRUNC | MSG_CTRUNC)) == 0;
  // Magic and version come first in every version.
  if (got < 16 || message.record.magic != kSegmentMagic) return Received::kClosed;
  if (message.record.abi != kSegmentAbi) return Received::kMessage;
  return is_whole ? Received::kMessage : Received::kClosed;
}

bool is_closed(const Descriptor& connection) noexcept {
  char byte = 0;
  const ssize_t got = ::recv(connection.get(), &byte, 1, MSG_PEEK | MSG_DONTWAIT);
  return got == 0 || (got < 0 && errno != EAGAIN && errno != EINTR);
}

bool has_hung_up(const Descriptor& connection) noexcept {
  pollfd end{connection.get(), 0, 0};
  return ::poll(&end, 1, 0) == 1 && (end.revents & (POLLHUP | POLLERR)) != 0;
}

ucred peer_of(const Descriptor& connection) noexcept {
  ucred peer{0, static_cast<uid_t>(-1), static_cast<gid_t>(-1)};
  socklen_t size = sizeof(peer);
  ::getsockopt(connection.get(), SOL_SOCKET, SO_PEERCRED, &peer, &size);
  return peer;
}

}  // namespace corbot
