// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdio>
#include <string>

namespace corbot::client {

/// Writes to a stream that may be gone, such as a closed terminal's. fmt::print would throw there. A command
/// that stops an arm or monitors its motion would then end before the arm is at rest.
inline void notice(std::FILE* stream, const std::string& text) noexcept {
  (void)std::fputs(text.c_str(), stream);
  (void)std::fflush(stream);
}

}  // namespace corbot::client
