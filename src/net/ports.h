// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <utility>

namespace corbot::net {

/// "HOST:PORT", port 1 … 65535. Nothing when it is not of that form.
[[nodiscard]] std::optional<std::pair<std::string, int>> split_endpoint(const std::string& text);

/// Why a TCP server could not listen there now; empty when it could.
[[nodiscard]] std::string listen_error(const std::string& host, int port);

/// Does a TCP server on the loopback accept connections at that port?
[[nodiscard]] bool listens_on_loopback(int port) noexcept;

}  // namespace corbot::net
