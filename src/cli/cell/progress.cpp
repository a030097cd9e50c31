// SPDX-License-Identifier: Apache-2.0
#include "cli/cell/progress.h"

#include <fmt/format.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include "cli/supervise/report.h"

namespace corbot::cli {
namespace {

/// Returns the width of the terminal less one: a line that fills it would continue in the next.
std::size_t columns_of_terminal() {
  winsize size{};
  const bool is_known = ::ioctl(STDOUT_FILENO, TIOCGWINSZ, &size) == 0 && size.ws_col > 1;
  return is_known ? size.ws_col - 1U : 79U;
}

}  // namespace

std::string placed_line(const WorkProgress& progress, double elapsed_s) {
  return fmt::format("{}{} pieces placed, {:.0f} s", progress.placed,
                     progress.total ? fmt::format(" of {}", *progress.total) : "", elapsed_s);
}

std::string progress_line(const WorkProgress& progress, double elapsed_s, std::size_t columns) {
  std::string line = placed_line(progress, elapsed_s);
  for (const std::string& robot : progress.robots) line += "; " + robot;
  return line.substr(0, columns);
}

ProgressDisplay::~ProgressDisplay() { draw(""); }

void ProgressDisplay::show(const WorkProgress& progress, double elapsed_s) {
  if (can_redraw()) return draw(progress_line(progress, elapsed_s, columns_of_terminal()));
  if (progress.placed == shown_) return;
  shown_ = progress.placed;
  report(placed_line(progress, elapsed_s));
}

}  // namespace corbot::cli
