// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string_view>

#include "shm/descriptor.h"

namespace corbot {

/// Writes lines to an output without ever waiting for its reader, e.g. a terminal stopped by Ctrl-S or a full
/// pipe. A line that does not fit is dropped. The number of dropped lines is reported as
/// soon as there is space.
class LineOutput {
 public:
  /// `fd` outlives this. A pipe or a terminal is opened once more, so that the non-blocking mode affects no
  /// other process that has it.
  explicit LineOutput(int fd);

  /// Writes a line and replaces a drawn one. Never waits.
  void write(std::string_view line) noexcept;
  /// Returns true for a terminal on which a line can be redrawn.
  [[nodiscard]] bool can_redraw() const noexcept;
  /// Shows a line that the next one replaces; "": removes it. Does nothing if can_redraw() is false. Never
  /// waits.
  void draw(std::string_view line) noexcept;
  [[nodiscard]] std::uint64_t left_out() const noexcept { return left_out_; }

 private:
  enum class Kind { kWaitsNever, kSocket, kOther };
  /// Returns the number of characters that fitted.
  [[nodiscard]] std::size_t put(std::string_view text) const noexcept;

  int fd_;
  Kind kind_{Kind::kOther};
  Descriptor own_;
  std::uint64_t left_out_{0};
  bool is_drawn_{false};  ///< a drawn line is shown
  bool is_torn_{false};   ///< the last line written lacks its end
};

}  // namespace corbot
