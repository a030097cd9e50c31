// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <functional>
#include <numbers>
#include <optional>

#include "corbot/kinematics/arm_kinematics.h"
#include "corbot/kinematics/path_form.h"
#include "random_arm.h"
#include "support/cases.h"

// A family over seeded poses of random arms, a hundred an arm: forward is the product of the matrices, and
// every solution comes back. CORBOT_SEED in the environment sets another seed, CORBOT_CASES another number;
// `scripts/nightly release` runs a million.

namespace corbot::test {

inline constexpr int kPoses = 250'000;

inline constexpr double kPi = std::numbers::pi;
inline constexpr int kPosesAnArm = 100;

inline const Mounting& mount_of(const OtherArm&) {
  static const Mounting none;
  return none;
}
template <class Form>
const Mounting& mount_of(const Form& form) {
  return form.mount;
}

/// Returns the distance at which the centre of a six-axis arm's wrist passes axis 1; 0 if a slide or the tool
/// sets it.
inline double lateral_m(const OrthoParallelArm& arm) { return arm.lateral_m; }
inline double lateral_m(const ParallelAxesArm& arm) { return arm.lateral_m; }
template <class Form>
double lateral_m(const Form&) {
  return 0.0;
}

/// Returns joints with the tool on the family's first axis, next to it, or at the least distance from it. For
/// six joints the wrist is there instead of the tool. The joints come from the inverse.
inline std::optional<Joints> on_axis(const Kinematics& arm, RandomArm& random, const Joints& q) {
  const Mounting& mount = arm.visit([](const auto& form) -> const Mounting& { return mount_of(form); });
  const double lateral = arm.visit([](const auto& form) { return lateral_m(form); });
  Pose pose = inverse_of(mount.base) * arm.forward(q);
  if (arm.joint_count() == 6) pose = pose * inverse_of(mount.hand);
  pose.position_m = {random.tiny(), lateral + (random.coin() ? random.tiny() : 0.0), pose.position_m[2]};
  if (arm.joint_count() == 6) pose = pose * mount.hand;
  const SolutionSet set = arm.solutions(mount.base * pose, q, kPi);
  if (set.count == 0) return std::nullopt;
  return set.entries[0].solution.joints_q;
}

/// Whether a singularity may be within 1e-6 m and rad of the pose: joints that cannot be proved to follow so
/// far.
inline bool is_beside_singularity(const Kinematics& arm, const Joints& q) {
  return !PathForm(arm, q).bound({1e-6, 1e-6, 1e-6, 1e-6, 1e-6, 1e-6}, {}, 1.0).is_proved;
}

struct Tally {
  double forward_m{}, forward_rad{};
  std::array<double, 2> back_m{}, back_rad{};  ///< of any pose; of singular ones, or next to those
  long solutions{}, singular{}, poses{};
};

inline void check(const Kinematics& arm, const DhTable& table, const Joints& q, const Joints& hint,
                  bool singular, Tally& tally) {
  const Pose pose = arm.forward(q);
  const Pose product = forward(table, q);
  tally.forward_m = std::max(tally.forward_m, norm(pose.position_m - product.position_m));
  tally.forward_rad = std::max(tally.forward_rad, angle_between(pose.orientation, product.orientation));
  const bool free_hand = arm.follows() == Follows::kNone;
  bool exact = false, same = false;
  for (const auto& [number, solution] : arm.solutions(pose, hint, kPi)) {
    const Pose back = arm.forward(solution.joints_q);
    const double error_rad = angle_between(back.orientation, pose.orientation);
    ASSERT_NEAR(error_rad, solution.orientation_error_rad, 1e-11) << "solution " << number;
    ++tally.solutions;
    tally.back_m[singular] = std::max(tally.back_m[singular], norm(back.position_m - pose.position_m));
    double apart = 0.0;
    for (std::size_t i = 0; i < arm.joint_count(); ++i) {
      const bool turns = arm.joint_kind(i) == JointKind::kRotary;
      const double away = solution.joints_q[i] - q[i];
      apart = std::max(apart, std::abs(turns ? wrap_angle(away) : away));
      if (turns) {
        ASSERT_LE(std::abs(solution.joints_q[i] - hint[i]), kPi + 1e-9) << "joint " << i;
      }
    }
    same = same || apart < 1e-6;
    if (free_hand || error_rad < 1e-9) {
      exact = true;
      if (arm.follows() != Follows::kFull) {
        const Angles angles = arm.followed().at(solution.joints_q);
        const IkSolution again = arm.inverse_at(pose.position_m, angles, number, solution.joints_q);
        ASSERT_EQ(again.status, IkStatus::kOk);
        const Pose same_pose = arm.forward(again.joints_q);
        tally.back_m[singular] =
            std::max(tally.back_m[singular], norm(same_pose.position_m - pose.position_m));
        const Angles same_angles = arm.followed().at(again.joints_q);
        ASSERT_NEAR(wrap_angle(same_angles[0] - angles[0]), 0.0, 1e-12);
        ASSERT_NEAR(wrap_angle(same_angles[1] - angles[1]), 0.0, 1e-12);
      }
      if (!free_hand) tally.back_rad[singular] = std::max(tally.back_rad[singular], error_rad);
    }
  }
  ASSERT_TRUE(exact) << "no solution at a pose that the arm can take";
  if (!singular) {
    ASSERT_TRUE(same) << "the joints themselves are no solution";
  }
  ++tally.poses;
  tally.singular += singular ? 1 : 0;
}

/// `table_of` makes an arm of this family; `go_singular(family, random, q)` brings joints to, or next to, a
/// place where two solutions meet.
template <class Form, class GoSingular>
void random_poses(const std::function<DhTable(RandomArm&)>& table_of, const GoSingular& go_singular) {
  RandomArm random{std::mt19937_64(seed())};
  Tally tally;
  const int poses = cases(kPoses);
  for (int n = 0; n < poses; n += kPosesAnArm) {
    const DhTable table = table_of(random);
    const Kinematics arm = Kinematics::recognise(joint_chain(table));
    ASSERT_STREQ(arm.family(), Form::kName) << "arm " << n / kPosesAnArm;
    for (int k = 0; k < kPosesAnArm; ++k) {
      Joints q{}, hint{};
      for (std::size_t i = 0; i < table.count; ++i) {
        const bool turns = arm.joint_kind(i) == JointKind::kRotary;
        q[i] = turns ? random.angle() : random.between(-1.0, 1.0);
        hint[i] = turns ? 2.0 * random.angle() : 0.0;
      }
      if (random.coin()) hint = q;
      const int kind = k % 8;
      if (kind < 3) {
        go_singular(std::get<Form>(arm.form()), random, q);
        if (kind > 0) {
          for (std::size_t i = 0; i < table.count; ++i) q[i] += random.coin() ? random.tiny() : 0.0;
        }
      } else if (kind == 3) {
        const auto there = on_axis(arm, random, q);
        if (there) q = *there;
        // Its crossing on axis 1: joint 1 is the hint's, also where only another one reaches.
        if (std::holds_alternative<ParallelAxesArm>(arm.form())) hint = q;
      }
      SCOPED_TRACE(testing::Message() << "arm " << n / kPosesAnArm << " pose " << k << " kind " << kind);
      check(arm, table, q, hint, kind < 4 || is_beside_singularity(arm, q), tally);
      if (testing::Test::HasFatalFailure()) return;
    }
  }
  std::cout << tally.poses << " poses, " << tally.singular << " of them beside a singularity, "
            << tally.solutions << " solutions; worst: forward " << tally.forward_m << " m, "
            << tally.forward_rad << " rad; back " << tally.back_m[0] << " m, " << tally.back_rad[0]
            << " rad; singular " << tally.back_m[1] << " m, " << tally.back_rad[1] << " rad\n";
  EXPECT_LT(tally.forward_m, 1e-12);
  EXPECT_LT(tally.forward_rad, 1e-12);
  EXPECT_LT(tally.back_m[0], 1e-12);
  EXPECT_LT(tally.back_rad[0], 1e-12);
  EXPECT_LT(tally.back_m[1], 1e-9);
  EXPECT_LT(tally.back_rad[1], 1e-9);
  EXPECT_GT(tally.singular, tally.poses / 3);
  EXPECT_LT(tally.singular, tally.poses * 6 / 10);
}

}  // namespace corbot::test
