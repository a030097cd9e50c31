// SPDX-License-Identifier: Apache-2.0
// Runs random poses and offsets of six-axis arms. The tool stays on its line, and turns about one axis at a
// constant rate in step with the path, in every tick. Both motions end at the pose.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <iostream>
#include <random>
#include <string>

#include "path_ticks.h"
#include "planner/planner.h"
#include "published_arm.h"
#include "support/cases.h"
#include "support/gate.h"

namespace corbot::property_poses_test {
namespace {

using test::Point;

constexpr double kExact = 1e-9;  // m and rad

/// Spherical linear interpolation of unit quaternions (Shoemake 1985), by the shorter way: written apart from
/// the planner's own.
Quaternion slerp(const Quaternion& a, Quaternion b, double s) {
  double cosine = a.w * b.w + a.x * b.x + a.y * b.y + a.z * b.z;
  if (cosine < 0.0) {
    b = {-b.w, -b.x, -b.y, -b.z};
    cosine = -cosine;
  }
  const double angle_rad = std::acos(std::min(cosine, 1.0));
  const double sine = std::sin(angle_rad);
  const double of_a = sine > 1e-9 ? std::sin((1.0 - s) * angle_rad) / sine : 1.0 - s;
  const double of_b = sine > 1e-9 ? std::sin(s * angle_rad) / sine : s;
  return normalised(
      {of_a * a.w + of_b * b.w, of_a * a.x + of_b * b.x, of_a * a.y + of_b * b.y, of_a * a.z + of_b * b.z});
}

class PoseMotions : public testing::TestWithParam<const char*> {
 protected:
  double in(double low, double high) { return std::uniform_real_distribution<double>(low, high)(engine_); }
  Joints joints() {
    Joints q{};
    for (std::size_t i = 0; i < arm_.dof; ++i) q[i] = in(arm_.joints[i].lower_q, arm_.joints[i].upper_q);
    return q;
  }
  Quaternion turn(double most_rad) {
    const Vector3 axis{in(-1, 1), in(-1, 1), in(-1, 1)};
    return about((1.0 / norm(axis)) * axis, in(-most_rad, most_rad));
  }
  Pose offset(int i) {
    const double size_m = i % 3 == 0 ? 0.0 : 0.1;
    return {{in(-size_m, size_m), in(-size_m, size_m), in(-size_m, size_m)}, turn(i % 4 == 0 ? 3.1 : 0.6)};
  }
  void expect_end(const Command& command, const Pose& wanted) {
    const Pose end = arm_.kinematics.forward(command.end_q);
    ASSERT_LT(test::distance(end.position_m, wanted.position_m), kExact);
    ASSERT_LT(angle_between(end.orientation, wanted.orientation), kExact);
  }
  void expect_accepted(const Command& command, const PlanResult& plan) {
    ASSERT_EQ(test::gate(arm_, command, test::rate_of(plan)), Verdict::kDone);
  }
  /// The set-points of the whole line, as the real-time task computes them.
  void expect_on_slerp(const Command& command, const PlannedRate& rate, const Pose& from, const Pose& to) {
    const double near = rate.pieces.empty() ? kExact : 1e-6;
    const int ticks = static_cast<int>(std::ceil(std::min(command.duration_s, 60.0) / 1e-3));
    for (int k = 0; k <= ticks; ++k) {
      const auto place = test::place_at(command, rate, command.duration_s * k / std::max(ticks, 1));
      const Pose tool = arm_.kinematics.forward(place.q);
      const Point on_line = from.position_m + place.s * (to.position_m - from.position_m);
      ASSERT_LT(test::distance(tool.position_m, on_line), near) << k << " of " << ticks;
      ASSERT_LT(angle_between(tool.orientation, slerp(from.orientation, to.orientation, place.s)), near)
          << k << " of " << ticks;
    }
  }

  ArmModel arm_ = test::published_arm(GetParam());
  std::mt19937_64 engine_{test::seed() + 5};
};

TEST_P(PoseMotions, ALineIsOnItsLineAndOnTheSlerpInEveryTick) {
  const Planner planner(arm_);
  const int cases = test::cases(300);
  int planned = 0;
  test::Tightest tightest;
  for (int i = 0; i < cases; ++i) {
    const PlanStart start{joints(), 0.0};
    const Pose here = arm_.kinematics.forward(start.position_q);
    const Pose there = here * offset(i);
    const PlanResult result = planner.plan(start, {}, MovePoseRequest{there, 0.0, true});
    if (std::holds_alternative<PlanRefusal>(result)) continue;
    const Command& command = std::get<std::vector<Command>>(result).front();
    ASSERT_NO_FATAL_FAILURE(expect_end(command, there)) << "case " << i;
    ASSERT_NO_FATAL_FAILURE(expect_accepted(command, result)) << "case " << i;
    ASSERT_NO_FATAL_FAILURE(expect_on_slerp(command, test::rate_of(result), here, there)) << "case " << i;
    ASSERT_NO_FATAL_FAILURE(
        test::check_ticks(arm_, {}, command, command.line, test::rate_of(result), &tightest))
        << "case " << i;
    ++planned;
  }
  std::cout << planned << " of " << cases << " lines planned\n";
  EXPECT_GT(planned, cases / 20);
}

TEST_P(PoseMotions, EveryPoseThatTheArmCanTakeIsReached) {
  const Planner planner(arm_);
  const int cases = test::cases(2000);
  for (int i = 0; i < cases; ++i) {
    const PlanStart start{joints(), 0.0};
    const Pose there = arm_.kinematics.forward(joints());
    const PlanResult result = planner.plan(start, {}, MovePoseRequest{there, 0.0, false});
    ASSERT_TRUE(std::holds_alternative<std::vector<Command>>(result))
        << "case " << i << ": " << std::get<PlanRefusal>(result).text;
    const Command& command = std::get<std::vector<Command>>(result).front();
    ASSERT_NO_FATAL_FAILURE(expect_accepted(command, result)) << "case " << i;
    ASSERT_NO_FATAL_FAILURE(expect_end(command, there)) << "case " << i;
  }
}

TEST_P(PoseMotions, AnOffsetIsThePoseThatItLeadsTo) {
  const Planner planner(arm_);
  const int cases = test::cases(500);
  int planned = 0;
  for (int i = 0; i < cases; ++i) {
    const PlanStart start{joints(), 0.0};
    const Pose here = arm_.kinematics.forward(start.position_q);
    const Pose by = offset(i);
    const OffsetFrame frame = i % 2 == 0 ? OffsetFrame::kBase : OffsetFrame::kTool;
    const Pose there = frame == OffsetFrame::kTool
                           ? here * by
                           : Pose{here.position_m + by.position_m, by.orientation * here.orientation};
    const bool straight = i % 4 < 2;
    const PlanResult result = planner.plan(start, {}, MoveRelativeRequest{by, frame, 0.0, straight});
    if (std::holds_alternative<PlanRefusal>(result)) continue;
    const Command& command = std::get<std::vector<Command>>(result).front();
    ASSERT_NO_FATAL_FAILURE(expect_accepted(command, result)) << "case " << i;
    ASSERT_NO_FATAL_FAILURE(expect_end(command, there)) << "case " << i;
    if (straight) {
      ASSERT_NO_FATAL_FAILURE(expect_on_slerp(command, test::rate_of(result), here, there)) << "case " << i;
    }
    ++planned;
  }
  std::cout << planned << " of " << cases << " offsets planned\n";
  EXPECT_GT(planned, cases / 20);
}

INSTANTIATE_TEST_SUITE_P(Arms, PoseMotions, testing::Values("puma560", "irb2400", "ur5e", "stanford"),
                         [](const auto& arm) { return std::string(arm.param); });

}  // namespace
}  // namespace corbot::property_poses_test
