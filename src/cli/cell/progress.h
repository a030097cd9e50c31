// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <vector>

namespace corbot::cli {

/// The work as it is now.
struct WorkProgress {
  int placed{0};                    ///< pieces that have arrived
  std::optional<int> total;         ///< nothing where that is not known
  std::vector<std::string> robots;  ///< "robot1 moves piece 3"
};

/// "3 of 12 pieces placed, 24 s".
[[nodiscard]] std::string placed_line(const WorkProgress& progress, double elapsed_s);
/// The same and what each robot does, cut at `columns`.
[[nodiscard]] std::string progress_line(const WorkProgress& progress, double elapsed_s, std::size_t columns);

/// Follows the work on standard output: on a terminal by one line that is drawn anew, else by a line for each
/// piece that has arrived.
class ProgressDisplay {
 public:
  ProgressDisplay() = default;
  ProgressDisplay(const ProgressDisplay&) = delete;
  ProgressDisplay& operator=(const ProgressDisplay&) = delete;
  ~ProgressDisplay();

  void show(const WorkProgress& progress, double elapsed_s);

 private:
  int shown_{0};  ///< pieces of the last line
};

}  // namespace corbot::cli
