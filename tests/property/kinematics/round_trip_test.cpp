// SPDX-License-Identifier: Apache-2.0
// FK(IK(p)) = p over a million seeded points. CORBOT_SEED in the environment sets another seed.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>
#include <random>

#include "corbot/kinematics/kinematics.h"

namespace corbot {
namespace {

constexpr double kPi = std::numbers::pi;
constexpr double deg(double degrees) { return degrees * kPi / 180.0; }

std::uint64_t seed() {
  const char* text = std::getenv("CORBOT_SEED");
  const std::uint64_t value = text != nullptr ? std::strtoull(text, nullptr, 0) : 1751;
  std::cout << "seed " << value << "\n";
  return value;
}

const std::array<ArmGeometry, 3> kArms{
    ArmGeometry{0.067, 0.120, 0.120, 0.100, {0.0, deg(10), 0.0, deg(-45)}},
    ArmGeometry{0.06731, 0.14605, 0.187325, 0.100, {0.0, deg(10), 0.0, deg(-45)}},
    ArmGeometry{0.1, 0.3, 0.2, 0.15, {deg(20), deg(-15), 0.0, deg(70)}}};

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

  Joints pose(const ArmGeometry& arm, Spot spot) {
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

TEST(RoundTrip, AMillionPointsComeBackOnEveryBranch) {
  Sampler sampler{std::mt19937_64(seed())};
  double worst_m = 0.0, worst_pitch = 0.0;
  std::array<std::array<long, kBranchCount>, static_cast<std::size_t>(Spot::kCount)> solved{};
  for (int i = 0; i < 1'000'000; ++i) {
    const ArmGeometry& arm = kArms[static_cast<std::size_t>(i % 3)];
    const auto spot = static_cast<Spot>((i / 3) % static_cast<int>(Spot::kCount));
    const Joints q = sampler.pose(arm, spot);
    const ToolPose pose = forward(arm, q);
    for (std::uint32_t k = 0; k < kBranchCount; ++k) {
      const auto branch = static_cast<Branch>(k);
      const IkResult ik = inverse(arm, pose.position_m, pose.pitch_rad, branch, 0.25);
      // The branch the pose lies on must exist; the one that faces the other way may not.
      if (is_backward(branch) == is_backward(branch_of(arm, q))) {
        ASSERT_EQ(ik.status, IkStatus::kOk) << "pose " << i << " branch " << k << " theta2 " << q[2];
      }
      if (ik.status != IkStatus::kOk) continue;
      ++solved[static_cast<std::size_t>(spot)][k];
      const ToolPose back = forward(arm, ik.position_q);
      const double error_m =
          std::hypot(back.position_m[0] - pose.position_m[0], back.position_m[1] - pose.position_m[1],
                     back.position_m[2] - pose.position_m[2]);
      ASSERT_LT(error_m, 1e-12) << "pose " << i << " branch " << k;
      worst_m = std::max(worst_m, error_m);
      worst_pitch = std::max(worst_pitch, std::abs(wrap_angle(back.pitch_rad - pose.pitch_rad)));
      for (std::size_t j = 0; j < 4; ++j) ASSERT_LE(std::abs(ik.position_q[j]), kPi);
      // Named for what it is, wherever neither name is a matter of rounding.
      if (std::abs(std::sin(ik.position_q[2])) > 1e-7 &&
          std::hypot(pose.position_m[0], pose.position_m[1]) > 1e-9) {
        ASSERT_EQ(branch_of(arm, ik.position_q), branch) << "pose " << i;
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
}  // namespace corbot
