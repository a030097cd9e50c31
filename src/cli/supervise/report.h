// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string_view>

#include "shm/descriptor.h"

namespace corbot::cli {

/// Lines for whoever reads an output of the supervisor, which must not hold it up: a terminal that was
/// stopped by Ctrl-S, a pipe that nobody empties. A line that finds no room is left out; how many were is
/// said as soon as there is room.
class LineOutput {
 public:
  /// `fd` outlives this. A pipe or a terminal is opened once more, so that not waiting concerns no other
  /// process that has it.
  explicit LineOutput(int fd);

  /// Never waits. Takes the place of a line that is drawn.
  void write(std::string_view line) noexcept;
  /// Whether it is a terminal on which a line can be drawn anew.
  [[nodiscard]] bool can_redraw() const noexcept;
  /// Shows a line that the next one takes the place of; empty: takes it away. Nothing where can_redraw() is
  /// false. Never waits.
  void draw(std::string_view line) noexcept;
  [[nodiscard]] std::uint64_t left_out() const noexcept { return left_out_; }

 private:
  enum class Kind { kWaitsNever, kSocket, kOther };
  /// How much of it found room.
  [[nodiscard]] std::size_t put(std::string_view text) const noexcept;

  int fd_;
  Kind kind_{Kind::kOther};
  Descriptor own_;
  std::uint64_t left_out_{0};
  bool is_drawn_{false};  ///< a drawn line is shown
  bool is_torn_{false};   ///< the last line that was written lacks its end
};

/// A line of a supervisor to standard output, and one of its log to standard error. From one thread.
void report(std::string_view line) noexcept;
void log(std::string_view line) noexcept;
/// LineOutput::can_redraw() and draw() of standard output. Lines of report() and log() take the place of a
/// drawn one.
[[nodiscard]] bool can_redraw() noexcept;
void draw(std::string_view line) noexcept;

}  // namespace corbot::cli
