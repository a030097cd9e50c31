// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdio>
#include <string>

namespace corbot::client {

/// Writes to a stream that may be gone, as a closed terminal's is. fmt::print would throw there, and a command that stops an
/// arm, or follows its motion, would end before the arm is at rest.
inline void notice(std::FILE* stream, const std::string& text) noexcept {
  (void)std::fputs(text.c_str(), stream);
  (void)std::fflush(stream);
}

}  // namespace corbot::client
