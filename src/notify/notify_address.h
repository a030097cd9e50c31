// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <sys/socket.h>
#include <sys/un.h>

namespace corbot {

/// The address at which the supervisor of this process, systemd or `corbot up`, receives reports:
/// NOTIFY_SOCKET.
struct NotifyAddress {
  sockaddr_un address{};
  socklen_t size{0};  ///< 0: there is no supervisor
};

[[nodiscard]] NotifyAddress notify_address() noexcept;
/// Returns true if this process has a supervisor, which keeps descriptors for the next process and starts it.
[[nodiscard]] inline bool is_supervised() noexcept { return notify_address().size != 0; }

}  // namespace corbot
