// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <optional>
#include <string>

namespace corbot::cli {

/// Standard input, a line at a time; nothing at its end, or once `end` is set.
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
