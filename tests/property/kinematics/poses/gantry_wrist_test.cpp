// SPDX-License-Identifier: Apache-2.0
#include "../random_poses.h"

namespace corbot::property_gantry_wrist_test {
namespace {

using test::RandomArm;

DhTable gantry_with_wrist(RandomArm& random) {
  DhTable table = random.gantry(3);
  table.count = 6;
  table.rows[3] = random.turning(0.0, random.square());
  table.rows[4] = random.turning(0.0, random.square());
  table.rows[4].d_m = 0.0;
  table.rows[5] = random.turning(random.offset(), random.angle());
  return table;
}

TEST(RandomPoses, GantryWithWrist) {
  test::random_poses<GantryWristArm>(gantry_with_wrist,
                                     [](const GantryWristArm& arm, RandomArm& random, Joints& q) {
                                       q[4] = random.straight() - arm.wrist.middle_zero_rad;
                                     });
}

TEST(GantryWristArm, HasTheWristOfEitherSideAtAPose) {
  RandomArm random{std::mt19937_64(1)};
  const Kinematics arm = Kinematics::recognise(joint_chain(gantry_with_wrist(random)));
  ASSERT_STREQ(arm.family(), GantryWristArm::kName);
  EXPECT_EQ(GantryWristArm::kKind, ArmKind::kCartesian);
  const Joints q{0.1, -0.2, 0.3, 0.4, 0.5, 0.6};
  const SolutionSet both = arm.solutions(arm.forward(q), q, 1e-9);
  ASSERT_EQ(both.count, 2u);
  for (std::size_t i = 0; i < 3; ++i) {
    EXPECT_NEAR(both.entries[0].solution.joints_q[i], both.entries[1].solution.joints_q[i], 1e-12);
  }
  EXPECT_GT(std::abs(both.entries[0].solution.joints_q[3] - both.entries[1].solution.joints_q[3]), 1.0);
}

TEST(GantryWristArm, IsNoneWithSlidesInAPlaneOrAnOffsetWrist) {
  RandomArm random{std::mt19937_64(1)};
  DhTable table = gantry_with_wrist(random);
  table.rows[4].d_m = 0.05;
  EXPECT_STREQ(Kinematics::recognise(joint_chain(table)).family(), OtherArm::kName);
  table.rows[4].d_m = 0.0;
  EXPECT_STREQ(Kinematics::recognise(joint_chain(table)).family(), GantryWristArm::kName);
  table.rows[0].alpha_rad = 0.0;
  table.rows[1].alpha_rad = 0.0;
  EXPECT_STREQ(Kinematics::recognise(joint_chain(table)).family(), OtherArm::kName);
}

}  // namespace
}  // namespace corbot::property_gantry_wrist_test
