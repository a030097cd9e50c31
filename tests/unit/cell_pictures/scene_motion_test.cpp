// SPDX-License-Identifier: Apache-2.0
#include "cell/pictures/scene_motion.h"

#include <gtest/gtest.h>

#include <algorithm>

namespace corbot::cell {
namespace {

/// Samples 50 ms apart: arm 1 moves from 2 s to 8 s, arm 2 from 6 s to 12 s.
SceneRecord two_arms() {
  SceneRecord record;
  record.cast.arms = {{"robot1", {0.02}}, {"robot2", {0.02}}};
  for (int i = 0; i <= 400; ++i) {
    const double time_s = 0.05 * i;
    const auto arm = [&](double from_s) {
      const double moved_m = 0.1 * std::clamp(time_s - from_s, 0.0, 6.0);
      return RecordedArm{.points_m = {{0, 0, 0}, {moved_m, 0, 0}}};
    };
    record.samples.push_back({time_s, {arm(2), arm(6)}, {}});
  }
  return record;
}

TEST(SceneMotion, CountsTheTimeInWhichBothArmsMove) {
  const SceneMotion motion = scene_motion(two_arms());
  EXPECT_NEAR(motion.begin_s, 2, 0.051);
  EXPECT_NEAR(motion.duration_s, 10, 0.11);
  EXPECT_NEAR(motion.both_move_share, 0.2, 0.01);
  EXPECT_NEAR(motion.moving_share.at("robot1"), 0.6, 0.01);
  EXPECT_NEAR(motion.moving_share.at("robot2"), 0.6, 0.01);
}

TEST(SceneMotion, IsZeroWhereNothingMoves) {
  SceneRecord record = two_arms();
  record.samples.resize(10);
  const SceneMotion motion = scene_motion(record);
  EXPECT_EQ(motion.duration_s, 0);
  EXPECT_EQ(motion.both_move_share, 0);
  EXPECT_EQ(motion.moving_share.at("robot1"), 0);
  EXPECT_EQ(scene_motion({}).duration_s, 0);
}

TEST(MovingSpans, LeaveOutShortPauses) {
  SceneRecord record = two_arms();
  for (SceneSample& sample : record.samples) {  // a rest from 4 s to 4.5 s
    if (sample.time_s > 4 && sample.time_s < 4.5) sample.arms[0].points_m[1].x() = 0.2;
  }
  ASSERT_EQ(moving_spans(record, 0).size(), 2u);
  const std::vector<TimeSpan> joined = moving_spans(record, 0, 0.6);
  ASSERT_EQ(joined.size(), 1u);
  EXPECT_NEAR(joined[0].from_s, 2, 0.051);
  EXPECT_NEAR(joined[0].to_s, 8, 0.051);
}

}  // namespace
}  // namespace corbot::cell
