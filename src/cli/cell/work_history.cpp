// SPDX-License-Identifier: Apache-2.0
#include "cli/cell/work_history.h"

#include <algorithm>

namespace corbot::cli {

std::optional<Period> period_of(const WorkHistory& history) {
  const auto& all = history.milestones;
  const auto is_placed = [](const PieceMilestone& what) { return what.milestone == Milestone::kPlaced; };
  const auto last = std::find_if(all.rbegin(), all.rend(), is_placed);
  if (last == all.rend() || last->time_s <= all.front().time_s) return std::nullopt;
  return Period{all.front().time_s, last->time_s};
}

std::vector<Span> spans_of(const WorkHistory& history, const std::string& robot, const Period& period) {
  std::vector<Span> spans;
  for (const cell::ActivityChange& change : history.activities) {
    if (change.robot != robot) continue;
    const double begin_s = std::clamp(change.time_s, period.begin_s, period.end_s);
    if (!spans.empty()) spans.back().period.end_s = begin_s;
    spans.push_back({{begin_s, period.end_s}, change.activity, change.piece, change.zone});
  }
  std::erase_if(spans, [](const Span& span) { return span.period.duration_s() <= 0; });
  return spans;
}

std::map<std::string, std::map<std::string, double>> zone_shares(const WorkHistory& history,
                                                                 const Period& period) {
  std::map<std::string, std::map<std::string, double>> shares;
  for (const std::string& robot : history.robots) {
    for (const Span& span : spans_of(history, robot, period)) {
      if (!span.zone.empty()) shares[span.zone][robot] += span.period.duration_s() / period.duration_s();
    }
  }
  return shares;
}

}  // namespace corbot::cli
