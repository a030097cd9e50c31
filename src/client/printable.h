// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>

namespace corbot::client {

/// Returns text from the network, safe for a terminal: printable ASCII, others as '?', at most 400
/// characters.
[[nodiscard]] std::string printable(std::string_view text);

}  // namespace corbot::client
