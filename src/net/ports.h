// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <utility>

namespace corbot::net {

/// Splits "HOST:PORT" or "[IPV6]:PORT", port 1 … 65535. Returns nothing, with the reason in `why`, for any
/// other text or if it means all addresses of this machine.
[[nodiscard]] std::optional<std::pair<std::string, int>> split_endpoint(const std::string& text,
                                                                        std::string* why = nullptr);
/// Joins host and port.
[[nodiscard]] std::string endpoint_text(const std::string& host, int port);

/// Returns why a TCP server could not listen there now, or "" if it could.
[[nodiscard]] std::string listen_error(const std::string& host, int port);

/// Returns true if a TCP server on the loopback accepts connections at that port.
[[nodiscard]] bool listens_on_loopback(int port) noexcept;

}  // namespace corbot::net
