// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <utility>

namespace corbot::net {

/// "HOST:PORT" or "[IPV6]:PORT", port 1 … 65535. Nothing, and the reason in `why`, when it is not of that
/// form or means all addresses of this machine.
[[nodiscard]] std::optional<std::pair<std::string, int>> split_endpoint(const std::string& text,
                                                                        std::string* why = nullptr);
/// The same the other way round.
[[nodiscard]] std::string endpoint_text(const std::string& host, int port);

/// Why a TCP server could not listen there now; empty when it could.
[[nodiscard]] std::string listen_error(const std::string& host, int port);

/// Does a TCP server on the loopback accept connections at that port?
[[nodiscard]] bool listens_on_loopback(int port) noexcept;

}  // namespace corbot::net
