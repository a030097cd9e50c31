// SPDX-License-Identifier: Apache-2.0
// The curve of joints and path parameter by its length: on the path, of unit speed, and as long as it is,
// also from and to a stretched arm.
#include "planner/rate/geometry.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <string>
#include <utility>

#include "corbot/kinematics/tool_pose.h"
#include "corbot/motion/path_joints.h"
#include "corbot/units.h"
#include "planner/planner.h"
#include "planner/rate/proof.h"
#include "support/test_arms.h"

namespace corbot::unit_rate_geometry_test {
namespace {

using rate::Cell;
using rate::Knot;
using rate::kPath;
using rate::plan_geometry;
using rate::State;

Joints joints_of(const State& z) {
  Joints q{};
  std::copy_n(z.begin(), q.size(), q.begin());
  return q;
}

/// Greatest errors of a list of knots, at many points between them.
struct Errors {
  double position_m{}, angle_rad{};
  double joint_q{};  ///< from the closed form's joints
  double speed{};    ///< of |dz/d lambda|, which is to be 1
  double length{};   ///< of the whole curve, as a part of it

  void take(const Errors& other) {
    position_m = std::max(position_m, other.position_m);
    angle_rad = std::max(angle_rad, other.angle_rad);
    joint_q = std::max(joint_q, other.joint_q);
    speed = std::max(speed, other.speed);
    length = std::max(length, other.length);
  }
};

double length(const State& z, const State& speed, std::size_t count) {
  double sum = (z[kPath] / speed[kPath]) * (z[kPath] / speed[kPath]);
  for (std::size_t i = 0; i < count; ++i) sum += (z[i] / speed[i]) * (z[i] / speed[i]);
  return std::sqrt(sum);
}

template <class Motion>
Errors errors(const ArmModel& arm, const Motion& motion, const Joints& start_q, const State& speed,
              const std::vector<Knot>& knots) {
  constexpr int kParts = 200;
  Errors most;
  double sum = 0.0;
  State last = knots.front().z;
  for (std::size_t n = 0; n + 1 < knots.size(); ++n) {
    const Cell cell(knots[n], knots[n + 1]);
    for (int k = 1; k <= kParts; ++k) {
      const State z = cell.at(static_cast<double>(k) / kParts);
      const Joints q = joints_of(z);
      const PathPoint wanted = point_at(motion, z[kPath]);
      const Pose there = arm.kinematics.forward(q);
      most.position_m = std::max(most.position_m, norm(there.position_m - wanted.position_m));
      if (arm.kinematics.follows() == Follows::kFull)
        most.angle_rad = std::max(most.angle_rad, angle_between(there.orientation, wanted.orientation));
      if (arm.kinematics.has_closed_form()) {
        const IkSolution ik = joints_at(arm, wanted, motion.solution, start_q);
        EXPECT_EQ(ik.status, IkStatus::kOk);
        for (std::size_t i = 0; i < arm.dof; ++i)
          most.joint_q = std::max(most.joint_q, std::abs(q[i] - ik.joints_q[i]));
      }
      most.speed = std::max(
          most.speed, std::abs(length(cell.at(static_cast<double>(k) / kParts, 1), speed, arm.dof) - 1.0));
      State chord{};
      for (std::size_t i = 0; i < z.size(); ++i) chord[i] = z[i] - last[i];
      sum += length(chord, speed, arm.dof);
      last = z;
    }
  }
  most.length = std::abs(knots.back().lambda_s / sum - 1.0);
  return most;
}

/// The command of a line or an arc, and its knots.
struct Case {
  Command command{};
  State speed{};
  rate::KnotList knots{std::vector<Knot>{}};
};

Case geometry(const ArmModel& arm, const Command& command) {
  Case c{command};
  const bool is_line = command.kind == MotionKind::kLine;
  const auto speed = [&](const auto& motion) { return rate::limits_of(arm, motion).speed; };
  c.speed = is_line ? speed(command.line) : speed(command.arc);
  c.knots = is_line ? plan_geometry(arm, command.line, command.start_q, c.speed)
                    : plan_geometry(arm, command.arc, command.start_q, c.speed);
  return c;
}

Errors errors(const ArmModel& arm, const Case& c) {
  const auto& knots = std::get<std::vector<Knot>>(c.knots);
  return c.command.kind == MotionKind::kLine ? errors(arm, c.command.line, c.command.start_q, c.speed, knots)
                                             : errors(arm, c.command.arc, c.command.start_q, c.speed, knots);
}

class RateGeometry : public testing::TestWithParam<const char*> {
 protected:
  double in(double low, double high) { return std::uniform_real_distribution<double>(low, high)(random_); }
  Vector3 near(const Vector3& p, double size) {
    return {p[0] + in(-size, size), p[1] + in(-size, size), p[2] + in(-size, size)};
  }
  ArmModel arm_ = test::arm_of(GetParam());
  std::mt19937_64 random_{1751};
};

TEST_P(RateGeometry, FollowsRandomLinesAndArcsWithUnitSpeed) {
  int planned = 0;
  Errors most;
  for (int i = 0; i < 200; ++i) {
    PlanStart from;
    for (std::size_t k = 0; k < arm_.dof; ++k)
      from.position_q[k] = in(arm_.joints[k].lower_q, arm_.joints[k].upper_q);
    const Pose here = arm_.kinematics.forward(from.position_q);
    PlanSettings s;
    if (arm_.kinematics.follows() == Follows::kPitch)
      s.tool_pitch_rad = tool_pose(arm_.kinematics, from.position_q).pitch_rad + (i % 2) * 0.3;
    if (arm_.kinematics.follows() == Follows::kFull && i % 2 == 1)
      s.tool_orientation = about({0.6, 0.0, 0.8}, 0.3) * here.orientation;
    const Vector3 p2 = near(here.position_m, 0.1), p3 = near(here.position_m, 0.1);
    const PlanResult result = i % 4 < 2 ? Planner(arm_).move_s(from, s, p2, 0.0)
                                        : Planner(arm_).move_c(from, s, here.position_m, p2, p3);
    if (std::holds_alternative<PlanRefusal>(result)) continue;
    const Case c = geometry(arm_, std::get<std::vector<Command>>(result).front());
    ASSERT_TRUE(std::holds_alternative<std::vector<Knot>>(c.knots))
        << "case " << i << ": " << std::get<PlanRefusal>(c.knots).text;
    ++planned;
    const auto& knots = std::get<std::vector<Knot>>(c.knots);
    EXPECT_LE(knots.size(), kMostKnots);
    EXPECT_EQ(knots.front().z[kPath], 0.0);
    EXPECT_EQ(knots.back().z[kPath], 1.0);
    for (std::size_t k = 0; k < arm_.dof; ++k) {
      EXPECT_EQ(knots.front().z[k], c.command.start_q[k]);
      EXPECT_NEAR(knots.back().z[k], c.command.end_q[k], 1e-9);
    }
    most.take(errors(arm_, c));
  }
  EXPECT_GT(planned, 50);
  EXPECT_LT(most.position_m, 1.1e-8);  // 1e-8 at the points that the planner looks at
  EXPECT_LT(most.angle_rad, 1.1e-8);
  EXPECT_LT(most.joint_q, 2e-6);  // next to an axis a joint's lever is short
  EXPECT_LT(most.speed, 1e-3);
  EXPECT_LT(most.length, 5e-5);
}

INSTANTIATE_TEST_SUITE_P(Arms, RateGeometry,
                         testing::Values("lynx5", "al5d_wr", "puma560", "scara_gx4", "stanford",
                                         "cartesian_ppp", "cylindrical_rpp", "polar_rrp", "xarm6"),
                         [](const auto& arm) { return std::string(arm.param); });

/// The line in the other direction.
LineMotion reversed(LineMotion line) {
  std::swap(line.from_m, line.to_m);
  std::swap(line.tool.from_angles_rad, line.tool.to_angles_rad);
  return line;
}

/// In the arm's plane, between two configurations of the Lynx 5 with one tool pitch.
LineMotion line_between(const ArmModel& arm, const Joints& a, const Joints& b) {
  LineMotion line{};
  line.from_m = arm.kinematics.forward(a).position_m;
  line.to_m = arm.kinematics.forward(b).position_m;
  line.tool.from = {1.0, 0.0, 0.0, 0.0};
  line.tool.from_angles_rad = arm.kinematics.followed().at(a);
  line.tool.to_angles_rad = arm.kinematics.followed().at(b);
  line.solution = *arm.kinematics.solution_of(b);
  return line;
}

Errors followed(const ArmModel& arm, const LineMotion& line, const Joints& start_q) {
  const State speed = rate::limits_of(arm, line).speed;
  const rate::KnotList knots = plan_geometry(arm, line, start_q, speed);
  if (const auto* refusal = std::get_if<PlanRefusal>(&knots)) {
    ADD_FAILURE() << refusal->text;
    return {};
  }
  return errors(arm, line, start_q, speed, std::get<std::vector<Knot>>(knots));
}

void expect_smooth(const Errors& e) {
  EXPECT_LT(e.position_m, 1.1e-8);
  EXPECT_LT(e.speed, 2e-3);
  EXPECT_LT(e.length, 1e-4);
}

/// The Lynx 5 with its wrist at a distance from the base axis and at a height above the shoulder, and its
/// tool pointing down.
Joints pointing_down(double wrist_r_m, double wrist_z_m) {
  constexpr double kLink_m = 0.12, kShoulder_q = to_radians(10.0), kWrist_q = to_radians(-35.0);
  const double middle = std::atan2(wrist_z_m, wrist_r_m);
  const double half = std::acos(0.5 * std::hypot(wrist_r_m, wrist_z_m) / kLink_m);
  const double shoulder_q = middle + half - kShoulder_q, elbow_q = 2.0 * half;
  return {0.3, shoulder_q, elbow_q, to_radians(-90.0) - shoulder_q + elbow_q - kWrist_q};
}

TEST(RateGeometrySingular, LeadsThroughTheBaseAxisOnAnotherSolution) {
  const ArmModel arm = test::arm_of("lynx5");
  const Joints before = pointing_down(0.05, 0.17);
  for (const double beyond_m : {0.02, 0.04, 0.07}) {
    SCOPED_TRACE(beyond_m);
    const Joints behind = pointing_down(-beyond_m, 0.18);
    LineMotion line = line_between(arm, before, behind);
    line.solution = *arm.kinematics.solution_of(before);
    ASSERT_NE(arm.kinematics.solution_of(behind), line.solution);
    const State speed = rate::limits_of(arm, line).speed;
    const rate::KnotList knots = plan_geometry(arm, line, before, speed);
    ASSERT_TRUE(std::holds_alternative<std::vector<Knot>>(knots)) << std::get<PlanRefusal>(knots).text;
    const Knot& end = std::get<std::vector<Knot>>(knots).back();
    for (std::size_t i = 0; i < arm.dof; ++i) EXPECT_NEAR(end.z[i], behind[i], 1e-9) << i;
    expect_smooth(errors(arm, line, before, speed, std::get<std::vector<Knot>>(knots)));
  }
}

TEST(RateGeometrySingular, PassesTheBaseAxisAtMicrometres) {
  const ArmModel arm = test::arm_of("lynx5");
  for (const double distance_m : {1e-2, 1e-3, 1e-4, 3e-5, 1.5e-5, 1e-6}) {
    SCOPED_TRACE(distance_m);
    Joints before = pointing_down(0.05, 0.17), behind = before;
    behind[0] = std::acos(distance_m / 0.05);
    before[0] = -behind[0];
    const Errors e = followed(arm, line_between(arm, before, behind), before);
    EXPECT_LT(e.position_m, 1.1e-7);
    EXPECT_LT(e.speed, 2e-2);
  }
}

TEST(RateGeometrySingular, RunsAlongTheBaseAxisWithoutTheBase) {
  const ArmModel arm = test::arm_of("lynx5");
  const Joints low = pointing_down(0.0, 0.17), high = pointing_down(0.0, 0.2);
  const LineMotion line = line_between(arm, low, high);
  const rate::KnotList knots = plan_geometry(arm, line, low, rate::limits_of(arm, line).speed);
  ASSERT_TRUE(std::holds_alternative<std::vector<Knot>>(knots)) << std::get<PlanRefusal>(knots).text;
  for (const Knot& knot : std::get<std::vector<Knot>>(knots)) EXPECT_EQ(knot.z[0], low[0]);
  expect_smooth(followed(arm, line, low));
}

TEST(RateGeometrySingular, BeginsAndEndsAtAStretchedArm) {
  const ArmModel arm = test::arm_of("lynx5");
  for (const double elbow_q : {0.0, 1e-9, 1e-6, 1e-4, 1e-2}) {
    for (const double bent_q : {0.3, 0.9}) {
      const Joints stretched{0.2, 0.5, elbow_q, -0.3 - elbow_q}, bent{0.2, 0.6, bent_q, -0.4 - bent_q};
      const LineMotion line = line_between(arm, stretched, bent);
      SCOPED_TRACE(elbow_q);
      const Errors from = followed(arm, line, stretched), to = followed(arm, reversed(line), bent);
      expect_smooth(from);
      expect_smooth(to);
    }
  }
  // Along the border of the reach, and by a little more than nothing.
  const Joints stretched{};
  LineMotion line = line_between(arm, stretched, stretched);
  for (const Vector3 by_m : {Vector3{-0.037, -0.034, -0.021}, {-1e-4, 0, -1e-4}, {-1e-8, 0, -1e-8}}) {
    for (std::size_t k = 0; k < 3; ++k) line.to_m[k] = line.from_m[k] + by_m[k];
    SCOPED_TRACE(by_m[0]);
    const Errors e = followed(arm, line, stretched);
    EXPECT_LT(e.position_m, 1.1e-7);
  }
  // From one stretched arm to another: the chord of a circle.
  const Joints low{0.2, 0.3, 0.0, -0.3}, high{0.2, 0.9, 0.0, -0.9};
  LineMotion chord = line_between(arm, low, high);
  for (const double elbow_q : {0.1, -0.1}) {
    chord.solution = *arm.kinematics.solution_of({0.2, 0.6, elbow_q, 0.0});
    const Errors e = followed(arm, chord, low);
    expect_smooth(e);
  }
}

TEST(RateGeometrySingular, IsRefusedWithinAPathAndBeyondReach) {
  const ArmModel arm = test::arm_of("lynx5");
  const auto refusal = [&](const LineMotion& line, const Joints& start_q) {
    const rate::KnotList knots = plan_geometry(arm, line, start_q, rate::limits_of(arm, line).speed);
    const auto* const refused = std::get_if<PlanRefusal>(&knots);
    return refused == nullptr ? PlanRefusal(PlanRefusal::Kind::kBadParameter, "", Quantity::kNumber)
                              : *refused;
  };
  const Joints start{0.0, 0.6, 0.9, -1.0};
  LineMotion line = line_between(arm, start, start);
  line.to_m[0] += 0.3;
  EXPECT_NE(refusal(line, start).text.find("leaves the arm's reach"), std::string::npos);
  EXPECT_GT(refusal(line, start).target_m[0], line.from_m[0] + 0.01) << "as far as it can be followed";
  EXPECT_LT(refusal(line, start).target_m[0], line.to_m[0] - 0.01);
  line.to_m = {-line.from_m[0], 0.0,
               line.from_m[2]};  // through the base axis, beyond what the arm can reach backwards
  EXPECT_EQ(refusal(line, start).kind, PlanRefusal::Kind::kUnreachable);
  EXPECT_LT(refusal(line, start).target_m[0], 0.0);
  EXPECT_GT(refusal(line, start).target_m[0], line.to_m[0] + 0.01);
}

TEST(RateGeometrySingular, IsRefusedAtTheStartWithoutAClosedForm) {
  ArmModel arm = test::arm_of("puma560");
  arm.kinematics = Kinematics::other(arm.kinematics.chain());
  const Joints start{0.0, 0.3, 0.3, 0.0, to_radians(-45.0), 0.0};  // axes 4 and 6 in one line
  LineMotion line{};
  const Pose here = arm.kinematics.forward(start);
  line.from_m = here.position_m;
  line.to_m = here.position_m + Vector3{0.0, 0.05, 0.05};
  line.tool.from = here.orientation;
  const rate::KnotList knots = plan_geometry(arm, line, start, rate::limits_of(arm, line).speed);
  ASSERT_TRUE(std::holds_alternative<PlanRefusal>(knots));
  EXPECT_NE(std::get<PlanRefusal>(knots).text.find("at a singularity"), std::string::npos);
}

TEST(RateGeometry, SpeedsAreThoseOfTheSettings) {
  const ArmModel arm = test::arm_of("puma560");
  PlanSettings settings;
  settings.speed_ratio = 0.5;
  settings.joint_speed_ratio[1] = 0.25;
  LineMotion line{};
  line.to_m = {0.2, 0.0, 0.0};
  const State by_length = rate::limits_of(arm, settings, line).speed;
  EXPECT_EQ(by_length[0], arm.joints[0].speed_q_s);
  EXPECT_EQ(by_length[1], 0.25 * arm.joints[1].speed_q_s);
  EXPECT_DOUBLE_EQ(by_length[kPath], 0.5 * arm.path.speed_m_s / 0.2);
  line.to_m = {1e-9, 0.0, 0.0};
  line.tool.turn_rad = {0.0, 0.0, 2.0};
  EXPECT_DOUBLE_EQ(rate::limits_of(arm, settings, line).speed[kPath],
                   0.5 * arm.path.rotation_speed_rad_s / 2.0);
}

TEST(RateGeometry, IsAsCloseToAnArcOfMicrometres) {
  for (const char* const name : {"cartesian_ppp", "lynx5"}) {
    const ArmModel arm = test::arm_of(name);
    PlanStart from;
    for (std::size_t i = 0; i < arm.dof; ++i)
      from.position_q[i] = 0.45 * arm.joints[i].lower_q + 0.55 * arm.joints[i].upper_q;
    const Vector3 here = arm.kinematics.forward(from.position_q).position_m;
    constexpr double kSize_m = 1e-6;
    PlanSettings fixed;  // the tool does not turn
    fixed.tool_pitch_rad = tool_pose(arm.kinematics, from.position_q).pitch_rad;
    const PlanSettings settings = has_tool_pitch(arm.kinematics) ? fixed : PlanSettings{};
    const PlanResult plan = Planner(arm).move_c(from, settings, here, here + Vector3{kSize_m, kSize_m, 0.0},
                                                here + Vector3{0.0, kSize_m, kSize_m});
    ASSERT_TRUE(std::holds_alternative<std::vector<Command>>(plan)) << name;
    const Command& command = std::get<std::vector<Command>>(plan).back();
    EXPECT_LE(errors(arm, geometry(arm, command)).position_m, 1e-6 * kSize_m) << name;
  }
}

TEST(RateCell, MeetsBothKnotsWithTwoDerivatives) {
  Knot a, b;
  a.z[1] = 0.3, a.rate[1] = -0.4, a.bend[1] = 2.0;
  b.z[1] = 0.1, b.rate[1] = 0.7, b.bend[1] = -1.0, b.lambda_s = 0.25;
  const Cell cell(a, b);
  EXPECT_EQ(cell.length_s(), 0.25);
  for (const auto& [t, knot] : {std::pair{0.0, a}, std::pair{1.0, b}}) {
    EXPECT_NEAR(cell.at(t)[1], knot.z[1], 1e-15);
    EXPECT_NEAR(cell.at(t, 1)[1], knot.rate[1], 1e-13);
    EXPECT_NEAR(cell.at(t, 2)[1], knot.bend[1], 1e-12);
  }
  constexpr double kStep = 1e-4;
  for (std::size_t order = 1; order <= 5; ++order) {
    const double difference =
        (cell.at(0.4 + kStep, order - 1)[1] - cell.at(0.4 - kStep, order - 1)[1]) / (2.0 * kStep * 0.25);
    EXPECT_NEAR(cell.at(0.4, order)[1], difference, 1e-6 * std::abs(difference)) << order;
  }
}

}  // namespace
}  // namespace corbot::unit_rate_geometry_test
