// SPDX-License-Identifier: Apache-2.0
// Lines and arcs with random tools, of arms that stand anywhere, carried out as the real-time task does: by a
// model with the profile's frames and what the record says. In every tick the tool centre point of that tool
// is on its path, within every limit.
#include <gtest/gtest.h>

#include <random>
#include <string>

#include "corbot/kinematics/tool_pose.h"
#include "path_ticks.h"
#include "planner/frame_settings.h"
#include "planner/planner.h"
#include "published_arm.h"
#include "random_frame.h"
#include "rt/cycle/path_evaluation.h"
#include "support/cases.h"
#include "support/gate.h"

namespace corbot::property_frames_test {
namespace {

using test::Point;

class FramedPaths : public testing::TestWithParam<const char*> {
 protected:
  static ArmModel model(const std::string& name) {
    return name == "lynx5" ? test::wide_arm() : test::published_arm(name);
  }
  double in(double low, double high) { return std::uniform_real_distribution<double>(low, high)(engine_); }

  /// Tools of both kinds: along the flange's axes, and askew.
  PlanSettings settings() {
    PlanSettings s;
    s.tool_frame = test::random_frame(engine_, in(0.0, 1.0) < 0.5 ? 0.2 : 0.02);
    if (in(0.0, 1.0) < 0.8) s.base_frame = test::random_frame(engine_, 3.0);
    return s;
  }
  PlanStart start() {
    PlanStart at{};
    for (std::size_t i = 0; i < arm_.dof; ++i)
      at.position_q[i] = in(arm_.joints[i].lower_q, arm_.joints[i].upper_q);
    return at;
  }
  Point near(const Point& p, double size) {
    return {p[0] + in(-size, size), p[1] + in(-size, size), p[2] + in(-size, size)};
  }

  /// As the cycle runs it.
  template <class Motion>
  void expect_on_path(const Kinematics& tool, const Command& command, const Motion& motion,
                      const PlannedRate& rate) {
    const double near_m = 1e-6;
    const int ticks = 200;
    for (int k = 0; k <= ticks; ++k) {
      const auto place = test::place_at(command, rate, command.duration_s * k / ticks);
      const Point tcp = tool.forward(place.q).position_m;
      ASSERT_LT(test::distance(tcp, point_at(motion, place.s).position_m), near_m) << k;
      ASSERT_LT(test::deviation(motion, tcp), near_m) << k;
    }
  }

  ArmModel arm_ = model(GetParam());
  std::mt19937_64 engine_{test::seed() + 11};
};

TEST_P(FramedPaths, LinesAndArcsStayOnThemWithinEveryLimitAndArrive) {
  int planned = 0;
  test::Tightest tightest;
  const int cases = test::cases(300);
  for (int i = 0; i < cases; ++i) {
    PlanSettings s = settings();
    if (check_tool_frame(arm_.kinematics, *s.tool_frame)) continue;
    const PlanStart from = start();
    ArmModel framed = arm_;
    framed.kinematics = in_frames(arm_.kinematics, s);
    const Pose here = framed.kinematics.forward(from.position_q);
    if (arm_.kinematics.follows() == Follows::kPitch) {
      const double angle = framed.kinematics.followed().at(from.position_q)[0];
      s.tool_pitch_rad = angle - angle_of_pitch(framed.kinematics, 0.0) + in(-0.2, 0.2);
    }
    if (arm_.kinematics.follows() == Follows::kFull && i % 3 == 0)
      s.tool_orientation = about({0.6, 0.0, 0.8}, in(-0.6, 0.6)) * here.orientation;
    const bool is_arc = i % 4 == 3;
    const Point target = near(here.position_m, i % 2 == 0 ? 0.1 : 0.02);
    const PlanResult result =
        is_arc ? Planner(arm_).move_c(from, s, here.position_m, near(here.position_m, 0.03), target)
               : Planner(arm_).move_s(from, s, target, 0.0);
    if (std::holds_alternative<PlanRefusal>(result)) continue;
    const auto& commands = std::get<std::vector<Command>>(result);
    for (std::size_t k = 0; k < commands.size(); ++k) {
      const Command& command = commands[k];
      const PlannedRate rate = test::rate_of(result, k);
      ASSERT_EQ(test::gate(arm_, command, rate), Verdict::kDone) << "case " << i;
      if (command.kind == MotionKind::kArc) {
        ASSERT_NO_FATAL_FAILURE(expect_on_path(framed.kinematics, command, command.arc, rate))
            << "case " << i;
        ASSERT_NO_FATAL_FAILURE(test::check_ticks(framed, s, command, command.arc, rate, &tightest))
            << "case " << i;
      } else {
        ASSERT_NO_FATAL_FAILURE(expect_on_path(framed.kinematics, command, command.line, rate))
            << "case " << i;
        ASSERT_NO_FATAL_FAILURE(test::check_ticks(framed, s, command, command.line, rate, &tightest))
            << "case " << i;
      }
    }
    const Joints end_q = std::get<std::vector<Command>>(result).back().end_q;
    const Pose end = framed.kinematics.forward(end_q);
    EXPECT_LT(test::distance(end.position_m, target), 1e-9) << "case " << i;
    if (arm_.kinematics.follows() == Follows::kFull) {
      EXPECT_LT(angle_between(end.orientation, s.tool_orientation.value_or(here.orientation)), 1e-8);
    }
    ++planned;
  }
  std::cout << planned << " of " << cases << " planned\n";
  EXPECT_GT(planned, cases / 20);
}

TEST_P(FramedPaths, FreeMotionsBringThisToolThere) {
  const int cases = test::cases(500);
  for (int i = 0; i < cases; ++i) {
    PlanSettings s = settings();
    if (check_tool_frame(arm_.kinematics, *s.tool_frame)) continue;
    const Kinematics tool = in_frames(arm_.kinematics, s);
    const Pose goal = tool.forward(start().position_q);
    s.tool_orientation = goal.orientation;
    const PlanResult result = Planner(arm_).move(start(), s, goal.position_m, 0.0);
    ASSERT_TRUE(std::holds_alternative<std::vector<Command>>(result))
        << "case " << i << ": " << std::get<PlanRefusal>(result).text;
    const Pose end = tool.forward(std::get<std::vector<Command>>(result).front().end_q);
    ASSERT_LT(test::distance(end.position_m, goal.position_m), 1e-9) << "case " << i;
    ASSERT_LT(angle_between(end.orientation, goal.orientation), 2e-6) << "case " << i;
  }
}

INSTANTIATE_TEST_SUITE_P(Arms, FramedPaths,
                         testing::Values("lynx5", "al5d_wr", "puma560", "ur5e", "scara_gx4", "cartesian_pppr",
                                         "cartesian_ppp", "cylindrical_rppr", "polar_rrp", "stanford"),
                         [](const auto& arm) { return std::string(arm.param); });

}  // namespace
}  // namespace corbot::property_frames_test
