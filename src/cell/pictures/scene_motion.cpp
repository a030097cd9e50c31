// SPDX-License-Identifier: Apache-2.0
#include "cell/pictures/scene_motion.h"

#include <algorithm>
#include <cstddef>

namespace corbot::cell {
namespace {

constexpr double kMoving_m_s = 0.002;

double speed_m_s(const RecordedArm& from, const RecordedArm& to, double span_s) {
  double farthest_m = 0;
  for (std::size_t i = 0; i < std::min(from.points_m.size(), to.points_m.size()); ++i)
    farthest_m = std::max(farthest_m, (to.points_m[i] - from.points_m[i]).norm());
  return span_s > 0 ? farthest_m / span_s : 0;
}

bool is_moving(const SceneSample& from, const SceneSample& to, std::size_t arm) {
  return speed_m_s(from.arms[arm], to.arms[arm], to.time_s - from.time_s) >= kMoving_m_s;
}

}  // namespace

std::vector<TimeSpan> moving_spans(const SceneRecord& record, std::size_t arm, double shortest_pause_s) {
  std::vector<TimeSpan> spans;
  for (std::size_t i = 1; i < record.samples.size(); ++i) {
    const SceneSample& from = record.samples[i - 1];
    const SceneSample& to = record.samples[i];
    if (!is_moving(from, to, arm)) continue;
    if (!spans.empty() && from.time_s - spans.back().to_s <= shortest_pause_s) {
      spans.back().to_s = to.time_s;
    } else {
      spans.push_back({from.time_s, to.time_s});
    }
  }
  return spans;
}

SceneMotion scene_motion(const SceneRecord& record) {
  SceneMotion motion;
  double end_s = 0;
  bool has_begun = false;
  double both_s = 0;
  for (const SceneCast::Arm& arm : record.cast.arms) motion.moving_share[arm.name] = 0;
  for (std::size_t i = 1; i < record.samples.size(); ++i) {
    const SceneSample& from = record.samples[i - 1];
    const SceneSample& to = record.samples[i];
    const double span_s = to.time_s - from.time_s;
    int moving = 0;
    for (std::size_t arm = 0; arm < record.cast.arms.size(); ++arm) {
      if (!is_moving(from, to, arm)) continue;
      ++moving;
      motion.moving_share[record.cast.arms[arm].name] += span_s;
    }
    if (moving == 0) continue;
    if (!has_begun) motion.begin_s = from.time_s;
    has_begun = true;
    end_s = to.time_s;
    if (moving > 1) both_s += span_s;
  }
  motion.duration_s = end_s - motion.begin_s;
  if (!has_begun) return motion;
  motion.both_move_share = both_s / motion.duration_s;
  for (auto& [name, share] : motion.moving_share) share /= motion.duration_s;
  return motion;
}

}  // namespace corbot::cell
