// SPDX-License-Identifier: Apache-2.0
#include "notify/notify_address.h"

#include <cstddef>
#include <cstdlib>
#include <cstring>
#include <string_view>

namespace corbot {

NotifyAddress notify_address() noexcept {
  NotifyAddress result;
  const char* const text = std::getenv("NOTIFY_SOCKET");
  const std::string_view path = text == nullptr ? std::string_view() : std::string_view(text);
  // A path, or a name in the kernel's abstract name space, which begins with '@'.
  if (path.size() < 2 || (path[0] != '/' && path[0] != '@') || path.size() >= sizeof(result.address.sun_path))
    return result;
  result.address.sun_family = AF_UNIX;
  std::memcpy(result.address.sun_path, path.data(), path.size());
  if (path[0] == '@') result.address.sun_path[0] = '\0';
  result.size = static_cast<socklen_t>(offsetof(sockaddr_un, sun_path) + path.size());
  return result;
}

}  // namespace corbot
