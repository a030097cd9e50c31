// SPDX-License-Identifier: Apache-2.0
#include "corbot/kinematics/path_form.h"

#include <gtest/gtest.h>

#include <cmath>

#include "arm_vectors.h"

namespace corbot::path_form_test {
namespace {

Kinematics arm(const char* name) { return Kinematics::recognise(joint_chain(test::arm_vectors(name).table)); }

TEST(PathForm, HasTheRatesOfALine) {
  // 1 mm along y for the tool of a stretched-out SCARA and a Lynx, by differences.
  for (const char* name : {"al5d", "al5d_wr", "scara_gx4", "cylindrical_rppr", "polar_rrp", "stanford"}) {
    const Kinematics k = arm(name);
    Joints q{0.3, 0.9, -0.6, 0.4, 0.5, 0.2};
    for (std::size_t i = k.joint_count(); i < kMaxJoints; ++i) q[i] = 0.0;
    const TaskRate along_y{0.0, 1.0, 0.0};
    const StretchBound bound = PathForm(k, q).bound(along_y, {}, 1e-5);
    ASSERT_TRUE(bound.is_proved) << name;
    const Joints rate = bound.rate_middle;
    Joints moved = q;
    for (std::size_t i = 0; i < kMaxJoints; ++i) moved[i] += 1e-6 * rate[i];
    const Vector3 step = k.forward(moved).position_m - k.forward(q).position_m;
    EXPECT_NEAR(step[0], 0.0, 1e-10) << name;
    EXPECT_NEAR(step[1], 1e-6, 1e-10) << name;
    EXPECT_NEAR(step[2], 0.0, 1e-10) << name;
    EXPECT_NEAR(angle_between(k.forward(moved).orientation, k.forward(q).orientation), 0.0,
                k.follows() == Follows::kFull ? 1e-10 : 1e-4)
        << name;
    for (std::size_t i = 0; i < k.followed().count; ++i) {
      EXPECT_NEAR(k.followed().at(moved)[i], k.followed().at(q)[i], 1e-15) << name;
    }
  }
}

TEST(PathForm, ProvesNothingAtASingularity) {
  const TaskRate slow{1e-3, 0.0, 0.0};
  EXPECT_FALSE(PathForm(arm("al5d"), {0.2, 0.5, 0.0, 0.3}).bound(slow, {}, 1e-9).is_proved) << "stretched";
  EXPECT_FALSE(PathForm(arm("scara_gx4"), {0.2, 0.0, -0.1, 0.3}).bound(slow, {}, 1e-9).is_proved)
      << "stretched";
  EXPECT_FALSE(PathForm(arm("stanford"), {0.2, 0.5, 0.5, 0.3, 0.0, 0.2}).is_regular()) << "straight wrist";
  EXPECT_FALSE(PathForm(Kinematics{}, {}).is_regular()) << "no arm";
}

TEST(PathForm, ProvesNoCellThatReachesASingularity) {
  // From 10 mm before the stretched arm outwards: proved up to some width, never beyond 10 mm.
  const Kinematics k = arm("scara_gx4");
  const double reach_m = 0.35 - 0.01;
  const IkSolution at = k.inverse_at({reach_m, 0.0, -0.1}, {0.0, 0.0}, 0, {});
  ASSERT_EQ(at.status, IkStatus::kOk);
  const PathForm form(k, at.joints_q);
  EXPECT_TRUE(form.bound({1.0, 0.0, 0.0, 0.0}, {}, 2e-4).is_proved);
  for (int step = 0; step < 48; ++step) {
    const double half_width = 0.01 * std::pow(1.1, step);
    EXPECT_FALSE(form.bound({1.0, 0.0, 0.0, 0.0}, {}, half_width).is_proved) << half_width;
  }
}

TEST(PathForm, OfAGantryIsExact) {
  const Kinematics k = arm("cartesian_ppp");
  const StretchBound bound = PathForm(k, {0.1, 0.1, 0.1}).bound({0.3, -0.2, 0.1}, {0.05, 0.0, 0.0}, 10.0);
  ASSERT_TRUE(bound.is_proved);
  EXPECT_NEAR(bound.rate_middle[0], -0.3, 1e-15);
  EXPECT_NEAR(bound.rate_bound[0], 0.35, 1e-6);
  EXPECT_NEAR(bound.rate_bound[1], 0.2, 1e-6);
  EXPECT_NEAR(bound.stray_q[2], 1.0, 1e-5);
}

}  // namespace
}  // namespace corbot::path_form_test
