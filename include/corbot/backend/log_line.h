// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

namespace corbot {

/// A line for the operator's log. Programs decide by its kind and never parse the text. Nothing here is
/// real-time safe.
struct LogLine {
  enum class Kind {
    kInfo,
    kWarning,
    kDegraded,  ///< a device is degraded; the text gives the cause
    kLost,      ///< a device is lost; the text gives the cause
  };
  Kind kind{Kind::kInfo};
  std::string text;
};

[[nodiscard]] inline bool is_warning(LogLine::Kind kind) noexcept {
  return kind == LogLine::Kind::kWarning || kind == LogLine::Kind::kLost;
}

/// Returns the line as the log shows it.
[[nodiscard]] inline std::string to_string(const LogLine& line) {
  if (line.kind == LogLine::Kind::kDegraded) return "degraded: " + line.text;
  if (line.kind == LogLine::Kind::kLost) return "lost: " + line.text;
  return line.text;
}

/// Returns all lines, without a newline at the end.
[[nodiscard]] inline std::string to_string(const std::vector<LogLine>& lines) {
  std::string text;
  for (const LogLine& line : lines) text += (text.empty() ? "" : "\n") + to_string(line);
  return text;
}

}  // namespace corbot
