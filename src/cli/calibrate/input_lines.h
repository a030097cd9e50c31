// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <optional>
#include <string>

namespace corbot::cli {

/// Reads standard input line by line. Returns nothing at its end, or when `end` is set.
class InputLines {
 public:
  explicit InputLines(const std::atomic<bool>& end) : end_(end) {}

  std::optional<std::string> next();

 private:
  const std::atomic<bool>& end_;
  std::string text_;
  bool ended_{false};
};

}  // namespace corbot::cli
