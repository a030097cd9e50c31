// SPDX-License-Identifier: Apache-2.0
#include "cli/cell/run_table.h"

#include <fmt/format.h>

#include <algorithm>

namespace corbot::cli {

std::vector<std::string> run_table(const WorkHistory& history, const RunFigures& figures) {
  std::vector<std::string> lines;
  const auto add = [&](const std::string& name, const std::string& value) {
    lines.push_back(fmt::format("  {:<16}  {}", name, value));
  };
  if (const auto period = period_of(history)) {
    const auto arrived = std::count_if(history.milestones.begin(), history.milestones.end(),
                                       [](const PieceMilestone& what) { return what.is_last; });
    add("pieces", fmt::format("{}{} in {:.1f} s", arrived,
                              arrived > 0 ? fmt::format(", {:.1f} s a piece,",
                                                        period->duration_s() / static_cast<double>(arrived))
                                          : "",
                              period->duration_s()));
    if (figures.both_move_share)
      add("both arms moved", fmt::format("{:.0f} % of the time", 100 * *figures.both_move_share));
    for (const auto& [zone, robots] : zone_shares(history, *period)) {
      std::string text;
      double free = 1;
      for (const auto& [robot, share] : robots) {
        text += fmt::format("{} {:.0f} %, ", robot, 100 * share);
        free -= share;
      }
      add("zone of " + zone, fmt::format("{}free {:.0f} %", text, 100 * std::max(free, 0.0)));
    }
  }
  if (figures.nearest_mm)
    add("least distance", fmt::format("{:.0f} mm between the arms", *figures.nearest_mm));
  std::string overruns;
  for (const auto& [program, count] : figures.overruns)
    overruns += fmt::format("{}{} {}", overruns.empty() ? "" : ", ", program, count);
  if (!overruns.empty()) add("overruns", overruns);
  return lines;
}

}  // namespace corbot::cli
