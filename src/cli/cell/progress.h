// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <vector>

namespace corbot::cli {

/// The present progress of the work.
struct WorkProgress {
  int placed{0};                    ///< pieces that have arrived
  std::optional<int> total;         ///< nothing if it is not known
  std::vector<std::string> robots;  ///< "robot1 moves piece 3"
};

/// Returns "3 of 12 pieces placed, 24 s".
[[nodiscard]] std::string placed_line(const WorkProgress& progress, double elapsed_s);
/// Returns the same line with the activity of each robot, cut at `columns`.
[[nodiscard]] std::string progress_line(const WorkProgress& progress, double elapsed_s, std::size_t columns);

/// Shows the work on standard output. A terminal gets one line that is redrawn, other outputs a line for each
/// piece that has arrived.
class ProgressDisplay {
 public:
  ProgressDisplay() = default;
  ProgressDisplay(const ProgressDisplay&) = delete;
  ProgressDisplay& operator=(const ProgressDisplay&) = delete;
  ~ProgressDisplay();

  void show(const WorkProgress& progress, double elapsed_s);

 private:
  int shown_{0};  ///< pieces in the last line
};

}  // namespace corbot::cli
