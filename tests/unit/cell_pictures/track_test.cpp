// SPDX-License-Identifier: Apache-2.0
#include "cell/pictures/track.h"

#include <gtest/gtest.h>

#include <cmath>

#include "cell/pictures/svg_animate.h"

namespace corbot::cell {
namespace {

TEST(Simplified, KeepsOnlyTheEndsOfAStraightLine) {
  Track track;
  for (int i = 0; i <= 100; ++i) track.push_back({0.05 * i, {2.0 * i, -1.0 * i}});
  const Track kept = simplified(track, 0.01);
  ASSERT_EQ(kept.size(), 2u);
  EXPECT_EQ(kept.back().values, track.back().values);
}

TEST(Simplified, StaysWithinItsToleranceOfEveryGivenKey) {
  Track track;
  for (int i = 0; i <= 2000; ++i) {
    const double t = 0.05 * i;
    track.push_back({t, {100 * std::sin(t), i % 700 < 350 ? 20.0 : 60.0, 30 * std::cos(3 * t)}});
  }
  for (const double tolerance : {0.5, 3.0, 10.0}) {
    const Track kept = simplified(track, tolerance);
    EXPECT_LT(kept.size(), track.size() * 3 / 4) << tolerance;
    for (const Key& key : track) {
      const std::vector<double> values = values_at(kept, key.time_s);
      for (std::size_t i = 0; i < values.size(); ++i)
        ASSERT_NEAR(values[i], key.values[i], tolerance + 1e-9) << key.time_s;
    }
  }
}

TEST(Played, HasKeysAtItsBeginAndEnd) {
  const Track part = played({{0, {0}}, {10, {10}}, {20, {0}}}, {.begin_s = 5, .end_s = 30, .factor = 4});
  ASSERT_EQ(part.size(), 4u);
  EXPECT_DOUBLE_EQ(part[0].values[0], 5);
  EXPECT_DOUBLE_EQ(part[1].values[0], 10);
  EXPECT_DOUBLE_EQ(part[3].time_s, 30);
  EXPECT_DOUBLE_EQ(part[3].values[0], 0) << "the last value holds";
}

TEST(SvgNumber, HasATenthAtMost) {
  EXPECT_EQ(svg_number(12.04), "12");
  EXPECT_EQ(svg_number(-0.01), "0");
  EXPECT_EQ(svg_number(-3.26), "-3.3");
  EXPECT_EQ(svg_number(100), "100");
}

}  // namespace
}  // namespace corbot::cell
