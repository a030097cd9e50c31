// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>
#include <vector>

// Checks which requests a panel accepts. The checks refuse pages of another origin, and foreign DNS names
// that point to this host (DNS rebinding).

namespace corbot::panel {

/// Returns whether `host` is a name of the loopback or one of `more`. `host` is as in the header Host, with
/// or without a port; the names in `more` have no port.
[[nodiscard]] bool is_host_allowed(std::string_view host, const std::vector<std::string>& more);

/// Returns whether `origin` is `host` with the scheme http or https. Both are as in the headers Origin and
/// Host of one request.
[[nodiscard]] bool is_same_origin(std::string_view origin, std::string_view host);

/// Returns whether both are equal. The comparison takes the same time for each wrong token of the right
/// length. An empty `token` refuses all.
[[nodiscard]] bool is_token(std::string_view given, std::string_view token);

/// Returns the token in the header Authorization, whose scheme is `Bearer` in any case (RFC 9110). Empty: the
/// header has another form.
[[nodiscard]] std::string_view bearer_token(std::string_view authorization);

/// Returns the value of `key` in the query of a request's target, without decoding. Empty: the query has
/// none.
[[nodiscard]] std::string_view query_value(std::string_view target, std::string_view key);

}  // namespace corbot::panel
