// SPDX-License-Identifier: Apache-2.0
// FK(IK(p)) = p over a million seeded points and tool pitches of four-axis arms. CORBOT_SEED in the
// environment sets another seed.
#include <gtest/gtest.h>

#include <algorithm>
#include <random>

#include "config/arms/four_axis.h"
#include "corbot/kinematics/tool_pose.h"
#include "inverse_at_pitch.h"
#include "support/cases.h"

namespace corbot::property_pitch_round_trip_test {
namespace {

constexpr double kPi = std::numbers::pi;
constexpr double deg(double degrees) { return degrees * kPi / 180.0; }

using Lengths = config::FourAxisLengths;

const std::array<Lengths, 3> kLengths{
    Lengths{0.067, 0.120, 0.120, 0.100, {0.0, deg(10), 0.0, deg(-45)}},
    Lengths{0.06731, 0.14605, 0.187325, 0.100, {0.0, deg(10), 0.0, deg(-45)}},
    Lengths{0.1, 0.3, 0.2, 0.15, {deg(20), deg(-15), 0.0, deg(70)}}};

/// Kinds of pose, so that the borders are met on purpose and not by luck.
enum class Spot {
  kAnywhere,
  kStretched,
  kFolded,
  kNearStretched,
  kNearFolded,
  kNearAxis,
  kLevelHand,
  kCount
};

struct Sampler {
  std::mt19937_64 random;
  double angle() { return std::uniform_real_distribution<double>(-kPi, kPi)(random); }
  double tiny() { return std::pow(10.0, std::uniform_real_distribution<double>(-16.0, -3.0)(random)); }

  Joints pose(const Lengths& arm, Spot spot) {
    Joints q{angle(), angle(), angle(), angle(), 0.0, 0.0};
    const double sign = q[2] < 0.0 ? -1.0 : 1.0;
    if (spot == Spot::kStretched) q[2] = 0.0;
    if (spot == Spot::kFolded) q[2] = sign * kPi;
    if (spot == Spot::kNearStretched) q[2] = sign * tiny();
    if (spot == Spot::kNearFolded) q[2] = sign * (kPi - tiny());
    if (spot == Spot::kLevelHand) q[3] = q[2] - q[1] - arm.offset_rad[1] - arm.offset_rad[3];
    if (spot == Spot::kNearAxis) {  // choose the hand such that the TCP comes close to the axis
      const double a = q[1] + arm.offset_rad[1];
      const double b = a - q[2];
      const double r = arm.l1_m * std::cos(a) + arm.l2_m * std::cos(b);
      if (std::abs(r) < arm.l3_m) q[3] = std::acos(-r / arm.l3_m) + tiny() - b - arm.offset_rad[3];
    }
    return q;
  }
};

/// Whether the tool is behind the base axis, seen along the heading of the arm's plane; on the axis it is
/// not.
bool is_backward(const ToolPose& pose) {
  const double ahead =
      pose.position_m[0] * std::cos(pose.yaw_rad) + pose.position_m[1] * std::sin(pose.yaw_rad);
  return ahead < -1e-13;
}

TEST(PitchRoundTrip, AMillionPointsComeBackOnEverySolution) {
  Sampler sampler{std::mt19937_64(test::seed())};
  double worst_m = 0.0, worst_pitch = 0.0;
  std::array<std::array<long, 4>, static_cast<std::size_t>(Spot::kCount)> solved{};
  std::array<Kinematics, 3> arms;
  for (std::size_t i = 0; i < arms.size(); ++i) {
    arms[i] = Kinematics::recognise(joint_chain(config::four_axis_table(kLengths[i])));
    ASSERT_EQ(arms[i].solution_count(), 4u);
  }
  for (int i = 0; i < 1'000'000; ++i) {
    const Kinematics& arm = arms[static_cast<std::size_t>(i % 3)];
    const auto spot = static_cast<Spot>((i / 3) % static_cast<int>(Spot::kCount));
    const Joints q = sampler.pose(kLengths[static_cast<std::size_t>(i % 3)], spot);
    const ToolPose pose = tool_pose(arm, q);
    const bool faces_away = is_backward(pose);
    for (std::uint32_t k = 0; k < 4; ++k) {
      const Joints hint{0.25};
      const IkSolution ik = test::inverse_at_pitch(arm, pose.position_m, pose.pitch_rad, k, hint);
      // The solutions on the pose's side must exist; those that face the other way may not.
      if (((k & 2u) != 0) == faces_away) {
        ASSERT_EQ(ik.status, IkStatus::kOk) << "pose " << i << " solution " << k << " theta2 " << q[2];
      }
      if (ik.status != IkStatus::kOk) continue;
      ++solved[static_cast<std::size_t>(spot)][k];
      const ToolPose back = tool_pose(arm, ik.joints_q);
      const double error_m =
          std::hypot(back.position_m[0] - pose.position_m[0], back.position_m[1] - pose.position_m[1],
                     back.position_m[2] - pose.position_m[2]);
      ASSERT_LT(error_m, 1e-12) << "pose " << i << " solution " << k;
      worst_m = std::max(worst_m, error_m);
      worst_pitch = std::max(worst_pitch, std::abs(wrap_angle(back.pitch_rad - pose.pitch_rad)));
      for (std::size_t j = 0; j < 4; ++j) ASSERT_LE(std::abs(ik.joints_q[j] - hint[j]), kPi + 1e-12);
      // Named for what it is, wherever neither name is a matter of rounding.
      if (std::abs(std::sin(ik.joints_q[2])) > 1e-7 &&
          std::hypot(pose.position_m[0], pose.position_m[1]) > 1e-9) {
        ASSERT_EQ(ik.joints_q[2] < 0.0, (k & 1u) != 0) << "pose " << i;
        ASSERT_EQ(is_backward(back), (k & 2u) != 0) << "pose " << i;
      }
    }
  }
  std::cout << "worst error " << worst_m << " m, " << worst_pitch << " rad\n";
  EXPECT_LT(worst_pitch, 1e-12);
  for (const auto& spot : solved) {
    for (const long count : spot) EXPECT_GT(count, 10'000) << "a kind of pose is hardly tested";
  }
}

}  // namespace
}  // namespace corbot::property_pitch_round_trip_test
