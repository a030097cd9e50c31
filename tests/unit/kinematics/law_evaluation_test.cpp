// SPDX-License-Identifier: Apache-2.0
#include "corbot/motion/law_evaluation.h"

#include <gtest/gtest.h>

#include <limits>

#include "corbot/motion/path.h"

namespace corbot::law_evaluation_test {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kInf = std::numeric_limits<double>::infinity();

TEST(Evaluate, FollowsTheSevenSegments) {
  // Jerk 1 for 1 s, acceleration 1 for 2 s, velocity 3 for 5 s: 3 · (4 + 5) = 27 units.
  const TimeLaw law{27.0, 1.0, 2.0, 5.0};
  EXPECT_EQ(law.duration_s(), 13.0);
  const auto expect = [&law](double t, double p, double v, double a, double j) {
    const LawState s = evaluate(law, t);
    EXPECT_NEAR(s.position, p, 1e-13) << t;
    EXPECT_NEAR(s.velocity, v, 1e-13) << t;
    EXPECT_NEAR(s.acceleration, a, 1e-13) << t;
    EXPECT_NEAR(s.jerk, j, 1e-12) << t;
  };
  expect(0.5, 1.0 / 48.0, 0.125, 0.5, 1.0);
  expect(2.0, 1.0 / 6.0 + 0.5 + 0.5, 1.5, 1.0, 0.0);
  expect(3.5, 6.0 - 3.0 * 0.5 + 1.0 / 48.0, 3.0 - 0.125, 0.5, -1.0);
  expect(6.0, 12.0, 3.0, 0.0, 0.0);
  expect(9.5, 27.0 - (6.0 - 1.5 + 1.0 / 48.0), 2.875, -0.5, -1.0);
  expect(12.5, 27.0 - 1.0 / 48.0, 0.125, -0.5, 1.0);
}

TEST(Evaluate, IsExactAtAndBeyondBothEnds) {
  const TimeLaw law{-0.1, 0.013, 0.017, 0.019};
  for (const double t : {0.0, -1.0, -kInf, kNan}) {
    EXPECT_EQ(evaluate(law, t).position, 0.0) << t;
    EXPECT_EQ(evaluate(law, t).velocity, 0.0) << t;
  }
  for (const double t : {law.duration_s(), 1.0, kInf}) {
    EXPECT_EQ(evaluate(law, t).position, -0.1) << t;
    EXPECT_EQ(evaluate(law, t).velocity, 0.0) << t;
  }
}

TEST(Evaluate, NeverGivesNan) {
  for (const double distance : {0.0, 5e-324, 1e-300, 1e-15, 1.0, 1e3}) {
    for (const double t : {0.0, 1e-200, 1e-100, 1.0, 1e3}) {
      for (const TimeLaw& law :
           {TimeLaw{distance, t, 0, 0}, TimeLaw{distance, t, t, t}, TimeLaw{distance, 0, t, 0},
            TimeLaw{distance, 0, 0, t}, TimeLaw{distance, 1e-150 * t, t, t}}) {
        for (const double part : {0.0, 0.1, 0.4, 0.5, 0.9, 1.0}) {
          const LawState s = evaluate(law, part * law.duration_s());
          ASSERT_FALSE(std::isnan(s.position) || std::isnan(s.velocity) || std::isnan(s.jerk) ||
                       std::isnan(s.acceleration))
              << distance << " " << t;
          ASSERT_LE(std::abs(s.position), distance);
        }
      }
    }
  }
}

TEST(Peaks, AreThoseOfTheShape) {
  const LawPeaks peak = peaks({-27.0, 1.0, 2.0, 5.0});
  EXPECT_NEAR(peak.velocity, 3.0, 1e-14);
  EXPECT_NEAR(peak.acceleration, 1.0, 1e-14);
  EXPECT_NEAR(peak.jerk, 1.0, 1e-14);
  EXPECT_EQ(peaks({0.0, 1.0, 2.0, 5.0}).velocity, 0.0);
}

TEST(IsWellFormed, TellsWhatCanBeRun) {
  EXPECT_TRUE(is_well_formed({1.0, 0.1, 0.0, 0.0}));
  EXPECT_TRUE(is_well_formed({1e-300, 1e-101, 0.0, 0.0}));
  EXPECT_TRUE(is_well_formed({0.0, 0.0, 0.0, 0.0}));
  EXPECT_TRUE(is_well_formed({0.0, 0.0, 0.0, 7.0}));
  EXPECT_FALSE(is_well_formed({1.0, 0.0, 0.0, 0.0}));
  EXPECT_FALSE(is_well_formed({1.0, 0.0, 1.0, 1.0}));
  EXPECT_FALSE(is_well_formed({1.0, -0.1, 1.0, 1.0}));
  EXPECT_FALSE(is_well_formed({kNan, 0.1, 0.0, 0.0}));
  EXPECT_FALSE(is_well_formed({1.0, kInf, 0.0, 0.0}));
  EXPECT_FALSE(is_well_formed({1.0, 0.1, kNan, 0.0}));
  EXPECT_FALSE(is_well_formed({kInf, 0.1, 0.0, 0.0}));
}

TEST(PointAt, IsExactAtTheEndsOfALine) {
  LineMotion line{};
  line.from_m = {0.1, 0.2, 0.3};
  line.to_m = {-0.7, 0.2, 1.1};
  line.tool.from = about({0.0, 0.0, 1.0}, 0.2);
  line.tool.turn_rad = {0.6, 0.0, 0.0};
  line.tool.from_angles_rad = {-0.3, 0.0};
  line.tool.to_angles_rad = {0.4, 0.1};
  EXPECT_EQ(point_at(line, 0.0).position_m, line.from_m);
  EXPECT_EQ(point_at(line, 1.0).position_m, line.to_m);
  EXPECT_EQ(point_at(line, 2.0).position_m, line.to_m);
  EXPECT_EQ(point_at(line, 1.0).angles_rad, (Angles{0.4, 0.1}));
  EXPECT_NEAR(point_at(line, 0.25).angles_rad[0], -0.125, 1e-15);
  const Quaternion turned = about({1.0, 0.0, 0.0}, 0.15) * line.tool.from;  // about an axis of the base
  EXPECT_LT(angle_between(point_at(line, 0.25).orientation, turned), 1e-15);
  EXPECT_NEAR(rotation_rad(line.tool), 0.6 + std::hypot(0.7, 0.1), 1e-15);
  EXPECT_NEAR(point_at(line, 0.25).position_m[0], -0.1, 1e-15);
  EXPECT_EQ(point_at(line, 0.3).position_m[1], 0.2);
  EXPECT_NEAR(length_m(line), std::hypot(0.8, 0.8), 1e-15);
}

TEST(PointAt, RunsAlongTheArcInItsSense) {
  ArcMotion arc{};
  arc.centre_m = {1.0, 2.0, 3.0};
  arc.u = {1.0, 0.0, 0.0};
  arc.v = {0.0, 0.0, 1.0};
  arc.radius_m = 2.0;
  arc.angle_rad = 3.0 * std::acos(0.0);
  const PathPoint third = point_at(arc, 1.0 / 3.0);
  EXPECT_NEAR(third.position_m[0], 1.0, 1e-15);
  EXPECT_NEAR(third.position_m[2], 5.0, 1e-15);
  EXPECT_NEAR(point_at(arc, 1.0).position_m[2], 1.0, 1e-15);
  EXPECT_NEAR(length_m(arc), 6.0 * std::acos(0.0), 1e-15);
}

}  // namespace
}  // namespace corbot::law_evaluation_test
