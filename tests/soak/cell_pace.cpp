// SPDX-License-Identifier: Apache-2.0
#include "soak/cell_pace.h"

#include <fmt/format.h>

#include <algorithm>

namespace corbot::soak {
namespace {

constexpr double kLargestRatio = 1.15;
constexpr double kLeastShare = 0.8;
constexpr const char* kLastRobot = "robot2";

/// The activity of both robots from one change of the record to the next one.
struct Stretch {
  double begin_s{};
  double end_s{};
  std::map<std::string, cell::ActivityChange> robots;

  [[nodiscard]] double seconds() const { return end_s - begin_s; }
  [[nodiscard]] int count(cell::Activity activity) const {
    return static_cast<int>(std::count_if(robots.begin(), robots.end(), [&](const auto& robot) {
      return !robot.second.zone.empty() && robot.second.activity == activity;
    }));
  }
  [[nodiscard]] bool is_zone_used() const {
    return std::any_of(robots.begin(), robots.end(),
                       [](const auto& robot) { return !robot.second.zone.empty(); });
  }
};

std::vector<Stretch> stretches_of(const std::vector<cell::ActivityChange>& changes) {
  std::vector<Stretch> stretches;
  std::map<std::string, cell::ActivityChange> robots;
  for (std::size_t i = 0; i + 1 < changes.size(); ++i) {
    robots[changes[i].robot] = changes[i];
    stretches.push_back({changes[i].time_s, changes[i + 1].time_s, robots});
  }
  return stretches;
}

/// When the last robot's pieces ended.
std::vector<double> ends_of(const std::vector<cell::ActivityChange>& changes) {
  std::vector<double> ends_s;
  std::uint64_t piece = 0;
  for (const cell::ActivityChange& change : changes) {
    if (change.robot != kLastRobot) continue;
    if (piece != 0 && change.piece != piece) ends_s.push_back(change.time_s);
    piece = change.piece;
  }
  return ends_s;
}

double median_gap(const std::vector<double>& ends_s) {
  std::vector<double> gaps_s;
  for (std::size_t i = 1; i < ends_s.size(); ++i) gaps_s.push_back(ends_s[i] - ends_s[i - 1]);
  const auto middle = gaps_s.begin() + static_cast<std::ptrdiff_t>(gaps_s.size() / 2);
  std::nth_element(gaps_s.begin(), middle, gaps_s.end());
  return *middle;
}

/// Returns the planned time of the motions that began while their robot was in the zone.
double planned_in(const Stretch& stretch, const PlannedMotions& motions) {
  double sum_s = 0;
  for (const auto& [robot, all] : motions) {
    const auto now = stretch.robots.find(robot);
    if (now == stretch.robots.end() || now->second.zone.empty()) continue;
    for (const PlannedMotion& motion : all)
      if (motion.begin_s >= stretch.begin_s && motion.begin_s < stretch.end_s) sum_s += motion.duration_s;
  }
  return sum_s;
}

}  // namespace

Pace pace_of(const std::vector<cell::ActivityChange>& changes, const PlannedMotions& motions) {
  const std::vector<double> ends_s = ends_of(changes);
  if (ends_s.size() < 2) return {};
  const double begin_s = std::find_if(changes.begin(), changes.end(), [](const auto& change) {
                           return change.piece != 0;
                         })->time_s;
  double used_s = 0;
  double planned_s = 0;
  double moves_s = 0;
  double looks_s = 0;
  for (const Stretch& stretch : stretches_of(changes)) {
    if (stretch.begin_s >= begin_s && stretch.is_zone_used()) used_s += stretch.seconds();
    // The sums are of whole pieces.
    if (stretch.begin_s < ends_s.front() || stretch.begin_s >= ends_s.back()) continue;
    planned_s += planned_in(stretch, motions);
    moves_s += stretch.count(cell::Activity::kMoving) * stretch.seconds();
    looks_s += stretch.count(cell::Activity::kLooking) * stretch.seconds();
  }
  const auto pieces = static_cast<double>(ends_s.size() - 1);
  return {ends_s.back() - begin_s, used_s / (changes.back().time_s - begin_s), median_gap(ends_s),
          (planned_s + looks_s) / pieces, (moves_s + looks_s) / pieces};
}

std::string missed_bounds(const Pace& pace) {
  std::string text;
  if (pace.median_s > kLargestRatio * pace.planned_s)
    text += fmt::format(
        "the median is more than {} of the planned motions and looks in the zone, {:.2f} s a piece; ",
        kLargestRatio, pace.planned_s);
  if (pace.zone_share < kLeastShare)
    text += fmt::format("the zone is in use less than {:.0f} % of the time; ", 100 * kLeastShare);
  return text.empty() ? text : text + "these bounds are for an otherwise idle machine";
}

}  // namespace corbot::soak
