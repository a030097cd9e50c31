// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <sys/socket.h>
#include <sys/un.h>

namespace corbot {

/// Where the supervisor of this process, systemd or `corbot up`, receives reports: NOTIFY_SOCKET.
struct NotifyAddress {
  sockaddr_un address{};
  socklen_t size{0};  ///< 0: there is none
};

[[nodiscard]] NotifyAddress notify_address() noexcept;
/// Whether this process has a supervisor: it keeps descriptors for the next one, and starts it.
[[nodiscard]] inline bool is_supervised() noexcept { return notify_address().size != 0; }

}  // namespace corbot
