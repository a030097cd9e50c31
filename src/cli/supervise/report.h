// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string_view>

namespace corbot::cli {

/// Write a line of a supervisor to standard output, and one of its log to standard error. From one thread.
void report(std::string_view line) noexcept;
void log(std::string_view line) noexcept;
/// LineOutput::can_redraw() and draw() for standard output. Lines of report() and log() replace a drawn one.
[[nodiscard]] bool can_redraw() noexcept;
void draw(std::string_view line) noexcept;

}  // namespace corbot::cli
