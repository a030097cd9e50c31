// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>
#include <vector>

// Which requests a panel takes, whatever a page of another origin or a DNS name that points here (DNS rebinding) asks for.

namespace corbot::panel {

/// `host` is as in the header Host, with a port or without: a name of the loopback, or one of `more`, which have no port.
[[nodiscard]] bool is_host_allowed(std::string_view host, const std::vector<std::string>& more);

/// `origin` is as in the header Origin. It has the scheme http or https, and `host` is as in the header Host of that request.
[[nodiscard]] bool is_same_origin(std::string_view origin, std::string_view host);

/// Takes the same time for each wrong token of the right length. An empty `token` refuses all.
[[nodiscard]] bool is_token(std::string_view given, std::string_view token);

/// The value of `key` in the query of a request's target, as it stands there; empty: it has none.
[[nodiscard]] std::string_view query_value(std::string_view target, std::string_view key);

}  // namespace corbot::panel
