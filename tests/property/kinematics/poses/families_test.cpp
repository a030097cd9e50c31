// SPDX-License-Identifier: Apache-2.0
// Every family over seeded random poses: ../random_poses.h.
#include "../random_poses.h"

namespace corbot::property_families_test {
namespace {

using test::kPi;
using test::random_poses;
using test::RandomArm;

/// Joints at, or next to, a place where two solutions meet; each family has its own.
void go_singular(const PlanarArm& arm, RandomArm& random, Joints& q) {
  const double zero = arm.count == 3 ? std::atan2(arm.mount.hand.position_m[2], arm.mount.hand.position_m[0])
                                     : arm.links.fore_zero_rad;
  q[2] = arm.links.sign3 * (random.straight() - zero + arm.links.upper_zero_rad);
}
void go_singular(const ScaraArm& arm, RandomArm& random, Joints& q) {
  const Vector3& tool = arm.mount.hand.position_m;
  const double zero = arm.rotaries == 3 ? arm.second_zero_rad : std::atan2(tool[1], tool[0]);
  q[arm.turns[1]] = arm.signs[1] * (random.straight() - zero);
}
void go_singular(const GantryArm&, RandomArm& random, Joints& q) { q[3] = random.straight(); }
void go_singular(const CylindricalArm& arm, RandomArm&, Joints& q) {
  q[arm.reach] = -(arm.count == 4 ? arm.ahead_m : arm.mount.hand.position_m[0]);
}
void go_singular(const PolarArm& arm, RandomArm& random, Joints& q) {
  if (arm.has_wrist && random.coin()) {
    q[4] = random.straight() - arm.wrist.middle_zero_rad;
  } else {
    q[2] = -(arm.has_wrist ? arm.slide_m : arm.mount.hand.position_m[0]);
  }
}
void go_singular(const OrthoParallelArm& arm, RandomArm& random, Joints& q) {
  if (random.coin()) q[4] = random.straight() - arm.wrist.middle_zero_rad;
  if (random.coin())
    q[2] = arm.links.sign3 * (random.straight() - arm.links.fore_zero_rad + arm.links.upper_zero_rad);
}
void go_singular(const ParallelAxesArm& arm, RandomArm& random, Joints& q) {
  if (random.coin()) q[4] = random.straight() - arm.middle_zero_rad;
  if (random.coin())
    q[2] = arm.links.sign3 * (random.straight() - arm.links.fore_zero_rad + arm.links.upper_zero_rad);
}

const auto kSingular = [](const auto& arm, RandomArm& random, Joints& q) { go_singular(arm, random, q); };

TEST(RandomPoses, PlanarWithoutWrist) {
  random_poses<PlanarArm>([](RandomArm& r) { return r.planar(3); }, kSingular);
}
TEST(RandomPoses, PlanarWithWrist) {
  random_poses<PlanarArm>([](RandomArm& r) { return r.planar(4); }, kSingular);
}
TEST(RandomPoses, PlanarWithRoll) {
  random_poses<PlanarArm>([](RandomArm& r) { return r.planar(5); }, kSingular);
}
TEST(RandomPoses, Scara) {
  random_poses<ScaraArm>([](RandomArm& r) { return r.scara(r.coin() ? 3 : 4); }, kSingular);
}
TEST(RandomPoses, Gantry) {
  random_poses<GantryArm>([](RandomArm& r) { return r.gantry(r.coin() ? 3 : 4); }, kSingular);
}
TEST(RandomPoses, Cylindrical) {
  random_poses<CylindricalArm>([](RandomArm& r) { return r.cylindrical(r.coin() ? 3 : 4); }, kSingular);
}
TEST(RandomPoses, Polar) {
  random_poses<PolarArm>([](RandomArm& r) { return r.polar(3); }, kSingular);
}
TEST(RandomPoses, OrthoParallel) {
  random_poses<OrthoParallelArm>([](RandomArm& r) { return r.ortho_parallel(); }, kSingular);
}
TEST(RandomPoses, ParallelAxes) {
  random_poses<ParallelAxesArm>([](RandomArm& r) { return r.parallel_axes(); }, kSingular);
}
TEST(RandomPoses, PolarWithWrist) {
  random_poses<PolarArm>([](RandomArm& r) { return r.polar(6); }, kSingular);
}

}  // namespace
}  // namespace corbot::property_families_test
