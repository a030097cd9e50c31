// SPDX-License-Identifier: Apache-2.0
// Motions that the planner has proved, stopped anywhere. The task finds no set-point outside, and none is
// more than the tolerance outside.
#include <gtest/gtest.h>

#include <algorithm>
#include <random>

#include "corbot/kinematics/arm_parts.h"
#include "rt/rig.h"
#include "seed.h"
#include "workspace_case.h"

namespace corbot::test::workspace_stops_test {
namespace {

class WorkspaceStops : public ::testing::TestWithParam<const char*> {
 protected:
  /// The least clearance of the present set-point.
  static double clearance(const Rig& rig) {
    const JointChain& chain = rig.arm.kinematics.chain();
    const ArmParts parts = parts_of(chain);
    const auto states = part_states(chain, parts, rig.snapshot.position_q);
    double least_m = 1e9;
    for (std::size_t k = 0; k < rig.arm.workspace.count; ++k) {
      const WorkspaceShape& shape = rig.arm.workspace.shapes[k];
      for (std::size_t part = 0; part < kArmParts; ++part) {
        if (parts[part].exists && (shape.parts & bit_of(part)) != 0)
          least_m = std::min(least_m, clearance_m(shape, states[part].position_m));
      }
    }
    return least_m;
  }
  /// Runs all commands up to this one to their ends, with a Stop in this cycle.
  static void run(Rig& rig, std::uint64_t last_id, int stop_at) {
    const double allowed_m = std::min(0.0, clearance(rig)) - kWorkspaceTolerance_m - 1e-9;
    int cycles = 0;
    while (rig.snapshot.last_done_id < last_id) {
      if (cycles++ == stop_at) rig.stop();
      rig.step();
      EXPECT_GE(clearance(rig), allowed_m);
      if (::testing::Test::HasFailure() || cycles > 100'000) break;
    }
    rig.step(3);  // a Stop is done a cycle after the motion
    EXPECT_FALSE(rig.alarm().has_value());
    EXPECT_EQ(rig.snapshot.state, RtState::kStandby);
    while (rig.completion()) {
    }
  }
};

TEST_P(WorkspaceStops, StayInside) {
  std::mt19937_64 random(seed());
  const ArmModel free_arm = arm_of(GetParam());
  const WorkspaceCase draw{free_arm, random};
  int planned = 0;
  for (int i = 0; i < cases(30) && !HasFailure(); ++i) {
    SCOPED_TRACE(i);
    ArmModel arm = free_arm;
    arm.period_ns = 4'000'000;
    arm.workspace.count = 1 + static_cast<std::uint32_t>(i % 3);
    for (std::size_t k = 0; k < arm.workspace.count; ++k) arm.workspace.shapes[k] = draw.shape();
    Rig rig(arm);
    rig.restart({.position_q = draw.joints(), .position_known = true});
    rig.step();
    for (int motion = 0; motion < 4 && !HasFailure(); ++motion) {
      const PlanResult plan = rig.planner.plan(rig.start(), {}, draw.request((i + motion) % 5, rig.start()));
      if (std::holds_alternative<PlanRefusal>(plan)) continue;
      ++planned;
      run(rig, rig.submit(plan), motion % 2 == 0 ? static_cast<int>(draw.in(1, 400)) : -1);
    }
  }
  EXPECT_GT(planned, 0);
}

INSTANTIATE_TEST_SUITE_P(Arms, WorkspaceStops, ::testing::ValuesIn(kTestArms));

}  // namespace
}  // namespace corbot::test::workspace_stops_test
