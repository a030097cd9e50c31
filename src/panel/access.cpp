// SPDX-License-Identifier: Apache-2.0
#include "panel/access.h"

#include <openssl/crypto.h>

#include <algorithm>
#include <array>
#include <cctype>

namespace corbot::panel {

namespace {

bool equals_ignoring_case(std::string_view a, std::string_view b) {
  return std::equal(a.begin(), a.end(), b.begin(), b.end(),
                    [](unsigned char x, unsigned char y) { return std::tolower(x) == std::tolower(y); });
}

bool is_digit(unsigned char c) { return std::isdigit(c) != 0; }

/// Returns the host in "HOST:PORT", "HOST" or "[IPV6]:PORT"; empty for any other form.
std::string_view name_of(std::string_view host) {
  const std::size_t bracket = host.starts_with('[') ? host.find(']') : 0;
  if (bracket == std::string_view::npos) return {};
  const std::size_t colon = host.find(':', bracket);
  if (colon == std::string_view::npos) return host;
  const std::string_view port = host.substr(colon + 1);
  return std::all_of(port.begin(), port.end(), is_digit) ? host.substr(0, colon) : std::string_view();
}

}  // namespace

bool is_host_allowed(std::string_view host, const std::vector<std::string>& more) {
  constexpr std::array<std::string_view, 3> kLoopback{"localhost", "127.0.0.1", "[::1]"};
  const std::string_view name = name_of(host);
  const auto is_name = [&](std::string_view allowed) { return equals_ignoring_case(name, allowed); };
  return !name.empty() && (std::any_of(kLoopback.begin(), kLoopback.end(), is_name) ||
                           std::any_of(more.begin(), more.end(), is_name));
}

bool is_same_origin(std::string_view origin, std::string_view host) {
  for (const std::string_view scheme : {"http://", "https://"}) {
    if (origin.starts_with(scheme)) return equals_ignoring_case(origin.substr(scheme.size()), host);
  }
  return false;
}

bool is_token(std::string_view given, std::string_view token) {
  return !token.empty() && given.size() == token.size() &&
         ::CRYPTO_memcmp(given.data(), token.data(), token.size()) == 0;
}

std::string_view bearer_token(std::string_view authorization) {
  constexpr std::string_view kBearer = "Bearer ";
  if (!equals_ignoring_case(authorization.substr(0, kBearer.size()), kBearer)) return {};
  authorization.remove_prefix(kBearer.size());
  return authorization;
}

std::string_view query_value(std::string_view target, std::string_view key) {
  std::size_t at = target.find('?');
  while (at != std::string_view::npos) {
    const std::size_t next = target.find('&', at + 1);
    const std::string_view part =
        target.substr(at + 1, next == std::string_view::npos ? next : next - at - 1);
    if (part.size() > key.size() && part.starts_with(key) && part[key.size()] == '=')
      return part.substr(key.size() + 1);
    at = next;
  }
  return {};
}

}  // namespace corbot::panel
