// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <cstdlib>
#include <memory>
#include <numbers>

#include "arm_vectors.h"
#include "corbot/kinematics/arm_kinematics.h"
#include "corbot/kinematics/path_form.h"
#include "support/paths.h"

// No kinematics allocates: this program brings its own malloc, which counts while armed. (Locks and system
// calls: tests/unit/rt/noalloc_test.cpp.)

#if CORBOT_SANITIZED

TEST(KinematicsAllocations, AreNotCountedUnderSanitizers) {
  GTEST_SKIP() << "the sanitizer brings its own malloc";
}

#else

namespace {

volatile bool armed = false;
volatile int allocations = 0;

}  // namespace

extern "C" {
void* __libc_malloc(size_t);
void __libc_free(void*);

void* malloc(size_t size) noexcept {
  if (armed) allocations = allocations + 1;
  return __libc_malloc(size);
}
void free(void* memory) noexcept { __libc_free(memory); }
}

namespace corbot {
namespace {

template <class Work>
int counted(Work&& work) {
  allocations = 0;
  armed = true;
  work();
  armed = false;
  return allocations;
}

TEST(KinematicsAllocations, AreNone) {
  for (const char* name : {"al5d", "al5d_wr", "so101", "puma560", "ur5e", "xarm6", "scara_gx4",
                           "cartesian_pppr", "cylindrical_rppr", "polar_rrp", "stanford"}) {
    const JointChain chain = joint_chain(test::arm_vectors(name).table);
    double sum = 0.0;
    EXPECT_EQ(counted([&] {
                Kinematics arm = Kinematics::recognise(chain);
                arm.set_frames(chain.base_T_0, chain.n_T_tool);
                const Joints q{0.1, 0.2, 0.3, 0.4, 0.5, 0.6};
                const Pose pose = arm.forward(q);
                sum += arm.jacobian(q)[0][0];
                sum += PathForm(arm, q).bound({0.1, 0.2, 0.3}, {}, 1e-3).rate_middle[0];
                sum += arm.inverse_at(pose.position_m, arm.followed().at(q), 0, q).joints_q[0];
                sum += arm.solution_of(q).value_or(0);
                for (const auto& [number, solution] : arm.solutions(pose, q, std::numbers::pi)) {
                  sum += solution.joints_q[0] + number;
                }
              }),
              0)
        << name;
    EXPECT_TRUE(std::isfinite(sum));
  }
}

TEST(KinematicsAllocations, AreSeen) {
  EXPECT_GT(counted([] { std::make_unique<std::array<double, 100>>()->fill(0.0); }), 0);
}

}  // namespace
}  // namespace corbot

#endif
