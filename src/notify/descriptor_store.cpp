// SPDX-License-Identifier: Apache-2.0
#include "notify/descriptor_store.h"

#include <fcntl.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cstdlib>
#include <cstring>
#include <string_view>

#include "notify/notify_address.h"

namespace corbot {
namespace {

constexpr int kFirst = 3;      // SD_LISTEN_FDS_START
constexpr int kAtMost = 1024;  // a larger number is not a valid count of descriptors

int number_of(const char* name) {
  const char* const text = std::getenv(name);
  int value = -1;
  if (text != nullptr) std::from_chars(text, text + std::strlen(text), value);
  return value;
}

bool send(const std::string& text, int fd) noexcept {
  NotifyAddress to = notify_address();
  if (to.size == 0) return false;
  const int socket = ::socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
  if (socket < 0) return false;
  iovec bytes{const_cast<char*>(text.data()), text.size()};
  alignas(cmsghdr) std::array<char, CMSG_SPACE(sizeof(int))> control{};
  msghdr message{};
  message.msg_name = &to.address;
  message.msg_namelen = to.size;
  message.msg_iov = &bytes;
  message.msg_iovlen = 1;
  if (fd >= 0) {
    message.msg_control = control.data();
    message.msg_controllen = control.size();
    cmsghdr* const part = CMSG_FIRSTHDR(&message);
    part->cmsg_level = SOL_SOCKET;
    part->cmsg_type = SCM_RIGHTS;
    part->cmsg_len = CMSG_LEN(sizeof(int));
    std::memcpy(CMSG_DATA(part), &fd, sizeof(fd));
  }
  const bool is_sent = ::sendmsg(socket, &message, MSG_NOSIGNAL) == static_cast<ssize_t>(text.size());
  ::close(socket);
  return is_sent;
}

}  // namespace

std::vector<KeptDescriptor> take_kept_descriptors() {
  std::vector<KeptDescriptor> kept;
  const int count = number_of("LISTEN_PID") == ::getpid() ? number_of("LISTEN_FDS") : 0;
  const char* const text = std::getenv("LISTEN_FDNAMES");
  std::string_view names(text != nullptr ? text : "");
  for (int fd = kFirst; fd < kFirst + count && count <= kAtMost; ++fd) {
    const std::size_t end = std::min(names.find(':'), names.size());
    if (::fcntl(fd, F_SETFD, FD_CLOEXEC) == 0) kept.push_back({std::string(names.substr(0, end)), fd});
    names.remove_prefix(std::min(end + 1, names.size()));
  }
  for (const char* variable : {"LISTEN_PID", "LISTEN_FDS", "LISTEN_FDNAMES"}) ::unsetenv(variable);
  return kept;
}

bool keep_descriptor(const std::string& name, int fd) noexcept {
  return send("FDSTORE=1\nFDPOLL=0\nFDNAME=" + name, fd);
}

bool drop_descriptor(const std::string& name) noexcept { return send("FDSTOREREMOVE=1\nFDNAME=" + name, -1); }

}  // namespace corbot
