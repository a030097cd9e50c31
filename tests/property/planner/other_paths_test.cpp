// SPDX-License-Identifier: Apache-2.0
// Runs random lines, arcs and motions to a point of arms without a closed form at 1 kHz, as the real-time
// task runs them. The tool stays within 1e-6 m and 1e-6 rad of the requested path, within every limit of
// joints and tool, and arrives.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <iostream>
#include <numbers>
#include <random>
#include <string>
#include <type_traits>

#include "arm_vectors.h"
#include "corbot/motion/path.h"
#include "path_ticks.h"
#include "planner/planner.h"
#include "support/cases.h"
#include "support/gate.h"

namespace corbot::property_other_paths_test {
namespace {

constexpr double kPi = std::numbers::pi;
constexpr double kTracking = 1e-6;
constexpr double kSlack = 1.0 + 1e-6;

struct Random {
  std::mt19937_64 engine;
  double in(double low, double high) { return std::uniform_real_distribution<double>(low, high)(engine); }
  Vector3 vector(double size) { return {in(-size, size), in(-size, size), in(-size, size)}; }
  Joints joints(const ArmModel& arm) {
    Joints q{};
    for (std::size_t i = 0; i < arm.dof; ++i) q[i] = in(arm.joints[i].lower_q, arm.joints[i].upper_q);
    return q;
  }
};

ArmModel model(const JointChain& chain) {
  ArmModel arm;
  arm.kind = ArmKind::kOther;
  arm.kinematics = Kinematics::other(chain);
  arm.dof = chain.count;
  for (std::size_t i = 0; i < arm.dof; ++i) {
    const bool turns = chain.axes[i].kind == JointKind::kRotary;
    arm.joints[i] = turns ? JointLimits{-3.0, 3.0, 3.0, 15.0, 150.0} : JointLimits{-0.3, 0.3, 0.6, 3.0, 30.0};
  }
  arm.path = {0.25, 1.0, 10.0, 1.5, 7.0, 70.0};
  arm.gripper = {0, 1000.0, 2000.0, 0.5};
  return arm;
}

/// Nothing parallel, square or crossing; every third arm of six joints has a slide.
JointChain any_chain(Random& random, std::uint32_t joints, bool slides) {
  DhTable table;
  table.count = joints;
  for (DhRow& row : table.rows) {
    row = {JointKind::kRotary, random.in(-kPi, kPi), random.in(-0.3, 0.3), random.in(-0.3, 0.3),
           random.in(-kPi, kPi)};
  }
  if (slides)
    table.rows[static_cast<std::size_t>(random.in(0.0, joints - 1e-9))].kind = JointKind::kPrismatic;
  return joint_chain(table);
}

struct Kind {
  std::string name;
  std::function<ArmModel(Random&, int)> arm;
};

std::vector<Kind> kinds() {
  return {{"Xarm6",
           [](Random&, int) {
             const test::ArmVectors vectors = test::arm_vectors("xarm6");
             ArmModel arm = model(joint_chain(vectors.table));
             for (std::size_t i = 0; i < 6; ++i) {
               arm.joints[i].lower_q = vectors.lower_q[i];
               arm.joints[i].upper_q = vectors.upper_q[i];
             }
             return arm;
           }},
          {"SixJoints", [](Random& random, int i) { return model(any_chain(random, 6, i % 3 == 0)); }},
          {"FiveJoints", [](Random& random, int i) { return model(any_chain(random, 5, i % 3 == 0)); }},
          {"FourJoints", [](Random& random, int i) { return model(any_chain(random, 4, i % 3 == 0)); }},
          {"ThreeJoints", [](Random& random, int i) { return model(any_chain(random, 3, i % 3 == 0)); }}};
}

/// The worst deviations and rates of the path over all ticks.
struct Track {
  double off_m{}, off_rad{}, joint_speed{}, acceleration{}, jerk{};
  std::size_t knots{};
};

template <class Motion>
void run(const ArmModel& arm, const PlanSettings& settings, const Command& command, const Motion& motion,
         const PlannedRate& rate, Track& track) {
  ASSERT_EQ(motion.knots.count, rate.knots.size());
  const double tick_s = std::max(1e-3, command.duration_s / 20'000.0);
  const int ticks = static_cast<int>(std::ceil(command.duration_s / tick_s));
  const bool is_full = arm.kinematics.follows() == Follows::kFull;
  const FollowedAngles followed = arm.kinematics.followed();
  ASSERT_EQ(followed.count, arm.dof == 6 ? 0 : arm.dof - 3);
  ASSERT_EQ(test::gate(arm, command, rate), Verdict::kDone);
  Joints last = command.start_q;
  std::array<Vector3, 4> tcp{};
  tcp.fill(arm.kinematics.forward(last).position_m);
  for (int k = 0; k <= ticks; ++k) {
    const auto [q, s] = test::place_at(command, rate, k * tick_s);
    const Pose tool = arm.kinematics.forward(q);
    const PathPoint wanted = point_at(motion, s);
    track.off_m = std::max(track.off_m, norm(tool.position_m - wanted.position_m));
    if (is_full) track.off_rad = std::max(track.off_rad, angle_between(tool.orientation, wanted.orientation));
    for (std::size_t n = 0; n < followed.count; ++n)
      track.off_rad = std::max(track.off_rad, std::abs(followed.at(q)[n] - wanted.angles_rad[n]));
    for (std::size_t i = 0; i < arm.dof; ++i) {
      const double limit = arm.joints[i].speed_q_s * settings.joint_speed_ratio[i];
      ASSERT_GE(q[i], arm.joints[i].lower_q - 1e-7) << "joint " << i << " tick " << k;
      ASSERT_LE(q[i], arm.joints[i].upper_q + 1e-7) << "joint " << i << " tick " << k;
      track.joint_speed = std::max(track.joint_speed, std::abs(q[i] - last[i]) / (limit * tick_s));
    }
    tcp = {tool.position_m, tcp[0], tcp[1], tcp[2]};
    const Vector3 v = tcp[0] - tcp[1], a = tcp[0] - 2.0 * tcp[1] + tcp[2];
    const Vector3 j = tcp[0] - 3.0 * tcp[1] + 3.0 * tcp[2] - tcp[3];
    ASSERT_LE(norm(v) / tick_s, arm.path.speed_m_s * settings.speed_ratio * kSlack + 1e-8) << "tick " << k;
    track.acceleration =
        std::max(track.acceleration, (norm(a) / (tick_s * tick_s) - 1e-7) / arm.path.acceleration_m_s2);
    track.jerk = std::max(track.jerk, (norm(j) / (tick_s * tick_s * tick_s) - 3e-4) / arm.path.jerk_m_s3);
    last = q;
  }
  for (std::size_t i = 0; i < arm.dof; ++i) ASSERT_NEAR(last[i], command.end_q[i], 1e-9);
  track.knots = std::max(track.knots, rate.knots.size());
}

void expect_good(const Track& track) {
  EXPECT_LT(track.off_m, kTracking);
  EXPECT_LT(track.off_rad, kTracking);
  EXPECT_LE(track.joint_speed, kSlack);
  EXPECT_LE(track.acceleration, kSlack);
  EXPECT_LE(track.jerk, kSlack);
}

class OtherPaths : public testing::TestWithParam<Kind> {
 protected:
  PlanSettings settings(int i, const ArmModel& arm, const Quaternion& present) {
    PlanSettings s;
    if (i % 3 == 0) s.speed_ratio = random_.in(0.05, 1.0);
    if (i % 5 == 0) s.joint_speed_ratio[static_cast<std::size_t>(i / 5) % arm.dof] = random_.in(0.05, 1.0);
    if (i % 2 == 0 && arm.kinematics.follows() == Follows::kFull) {
      const Vector3 axis = random_.vector(1.0);
      s.tool_orientation = about((1.0 / norm(axis)) * axis, random_.in(-1.0, 1.0)) * present;
    }
    return s;
  }
  Random random_{std::mt19937_64(test::seed() + 17)};
};

TEST_P(OtherPaths, LinesAndArcsAreFollowedWithinEveryLimit) {
  const int cases = test::cases(300);
  int planned = 0;
  Track worst;
  std::vector<std::size_t> knots;
  for (int i = 0; i < cases; ++i) {
    SCOPED_TRACE("case " + std::to_string(i));
    const ArmModel arm = GetParam().arm(random_, i);
    const PlanStart from{random_.joints(arm), 0.0};
    const Pose here = arm.kinematics.forward(from.position_q);
    const double size = i % 8 < 4 ? 0.15 : 0.02;
    const PlanSettings s = settings(i, arm, here.orientation);
    const Vector3 p2 = here.position_m + random_.vector(size), p3 = here.position_m + random_.vector(size);
    const Planner planner(arm);
    const PlanResult result =
        i % 2 == 0 ? planner.move_s(from, s, p3, 0.0) : planner.move_c(from, s, here.position_m, p2, p3);
    if (std::holds_alternative<PlanRefusal>(result)) continue;
    const auto& commands = std::get<std::vector<Command>>(result);
    ASSERT_EQ(result.rates.size(), commands.size());
    for (std::size_t k = 0; k < commands.size(); ++k) {
      const Command& command = commands[k];
      Track track;
      if (command.kind == MotionKind::kArc) {
        ASSERT_NO_FATAL_FAILURE(run(arm, s, command, command.arc, result.rates[k], track));
      } else {
        ASSERT_NO_FATAL_FAILURE(run(arm, s, command, command.line, result.rates[k], track));
      }
      ASSERT_NO_FATAL_FAILURE(expect_good(track));
      worst.off_m = std::max(worst.off_m, track.off_m);
      worst.off_rad = std::max(worst.off_rad, track.off_rad);
      worst.joint_speed = std::max(worst.joint_speed, track.joint_speed);
      worst.acceleration = std::max(worst.acceleration, track.acceleration);
      worst.jerk = std::max(worst.jerk, track.jerk);
      knots.push_back(track.knots);
    }
    const Pose end = arm.kinematics.forward(commands.back().end_q);
    EXPECT_LT(norm(end.position_m - p3), 1e-9);
    if (arm.kinematics.follows() == Follows::kFull) {
      EXPECT_LT(angle_between(end.orientation, s.tool_orientation.value_or(here.orientation)), 1e-8);
    }
    ++planned;
  }
  std::sort(knots.begin(), knots.end());
  ASSERT_FALSE(knots.empty());
  std::cout << planned << " of " << cases << " planned; off the path by up to " << worst.off_m << " m, "
            << worst.off_rad << " rad; of joint speeds " << worst.joint_speed
            << ", of the tool's acceleration " << worst.acceleration << ", jerk " << worst.jerk
            << "; knots: median " << knots[knots.size() / 2] << ", 95 % " << knots[knots.size() * 95 / 100]
            << ", most " << knots.back() << "\n";
  EXPECT_GT(planned, cases / 10);
}

TEST_P(OtherPaths, MotionsToAPointArriveWithTheOrientation) {
  const int cases = test::cases(100);
  int arrived = 0;
  for (int i = 0; i < cases; ++i) {
    const ArmModel arm = GetParam().arm(random_, i);
    const PlanStart from{random_.joints(arm), 0.0};
    const Pose goal = arm.kinematics.forward(random_.joints(arm));
    PlanSettings s;
    s.tool_orientation = goal.orientation;
    const PlanResult result = Planner(arm).move(from, s, goal.position_m, 0.0);
    if (std::holds_alternative<PlanRefusal>(result)) continue;
    const Pose end = arm.kinematics.forward(std::get<std::vector<Command>>(result).front().end_q);
    ASSERT_LT(norm(end.position_m - goal.position_m), 1e-9) << "case " << i;
    ASSERT_LT(angle_between(end.orientation, goal.orientation), arm.dof > 3 ? 1e-9 : 1e-6) << "case " << i;
    ++arrived;
  }
  EXPECT_GE(arrived, cases * 0.999);
}

/// Arms that have a closed form, planned without it.
class AsOther : public testing::TestWithParam<const char*> {};

TEST_P(AsOther, PlansThePathsThatTheClosedFormPlans) {
  Random random{std::mt19937_64(test::seed() + 29)};
  const test::ArmVectors vectors = test::arm_vectors(GetParam());
  ArmModel other = model(joint_chain(vectors.table));
  for (std::size_t i = 0; i < other.dof; ++i) {
    other.joints[i].lower_q = std::max(vectors.lower_q[i], -3.1);
    other.joints[i].upper_q = std::min(vectors.upper_q[i], 3.1);
  }
  ArmModel closed = other;
  closed.kinematics = Kinematics::recognise(other.kinematics.chain());
  ASSERT_TRUE(closed.kinematics.has_closed_form());
  int planned = 0, both = 0, slower = 0;
  const int cases = test::cases(400);
  for (int i = 0; i < cases; ++i) {
    const PlanStart from{random.joints(closed), 0.0};
    const Vector3 target = closed.kinematics.forward(from.position_q).position_m + random.vector(0.2);
    const PlanResult known = Planner(closed).move_s(from, {}, target, 0.0);
    if (std::holds_alternative<PlanRefusal>(known)) continue;
    ++planned;
    const PlanResult result = Planner(other).move_s(from, {}, target, 0.0);
    if (const auto* refusal = std::get_if<PlanRefusal>(&result)) {
      std::cout << "case " << i << ": " << refusal->text << "\n";
      continue;
    }
    ++both;
    const Command& a = std::get<std::vector<Command>>(known).front();
    const Command& b = std::get<std::vector<Command>>(result).front();
    EXPECT_TRUE(closed.kinematics.same(a.end_q, b.end_q, 1e-7)) << "case " << i;
    slower += b.duration_s > 1.02 * a.duration_s ? 1 : 0;
  }
  std::cout << both << " of " << planned << " paths planned without the closed form, " << slower
            << " slower\n";
  EXPECT_GT(planned, cases / 8);
  EXPECT_GE(both, planned * 0.98);
  EXPECT_LE(slower, both / 50);
}

INSTANTIATE_TEST_SUITE_P(Arms, AsOther,
                         testing::Values("puma560", "irb2400", "ur5e", "stanford", "polar_rrp",
                                         "cylindrical_rpp"),
                         [](const auto& arm) { return std::string(arm.param); });

INSTANTIATE_TEST_SUITE_P(Arms, OtherPaths, testing::ValuesIn(kinds()),
                         [](const auto& kind) { return kind.param.name; });

}  // namespace
}  // namespace corbot::property_other_paths_test
