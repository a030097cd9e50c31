// SPDX-License-Identifier: Apache-2.0
// Random motions of arms of all kinds among random floors, planes and boxes. A planned motion keeps to them
// in a dense reference, and a refused one would not.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "corbot/kinematics/arm_parts.h"
#include "corbot/motion/law_evaluation.h"
#include "corbot/motion/rate_knots.h"
#include "planner/planner.h"
#include "planner/workspace_proof.h"
#include "random_settings.h"
#include "seed.h"
#include "support/test_arms.h"
#include "workspace_case.h"

namespace corbot::property_workspace_test {
namespace {

constexpr int kSteps = 400;

/// The joints at a share of a command.
Joints joints_at(const Command& command, const PlannedRate* rate, double share) {
  Joints q = command.start_q;
  if (command.kind == MotionKind::kJoint) {
    for (std::size_t i = 0; i < q.size(); ++i)
      q[i] += evaluate(command.joint.law[i], share * command.duration_s).position;
  } else if (rate != nullptr && !rate->knots.empty()) {
    const double length_s = rate->knots.back().lambda_s;
    std::copy_n(rate::state_at(rate->knots, share * length_s).begin(), q.size(), q.begin());
  }
  return q;
}

/// The least clearance of a motion beyond what its start allows: at least 0 if the motion keeps inside.
double least_clearance(const ArmModel& arm, const WorkspaceLimits& limits, const PlanResult& result) {
  const ArmParts parts = parts_of(arm.kinematics.chain());
  const auto& commands = std::get<std::vector<Command>>(result);
  double least_m = 1e9;
  for (std::size_t c = 0; c < commands.size(); ++c) {
    const PlannedRate* rate = c < result.rates.size() ? &result.rates[c] : nullptr;
    const auto first = part_states(arm.kinematics.chain(), parts, commands[c].start_q);
    for (int i = 0; i <= kSteps; ++i) {
      const auto now = part_states(arm.kinematics.chain(), parts,
                                   joints_at(commands[c], rate, static_cast<double>(i) / kSteps));
      for (std::size_t k = 0; k < limits.count; ++k) {
        for (std::size_t part = 0; part < kArmParts; ++part) {
          if (!parts[part].exists || (limits.shapes[k].parts & bit_of(part)) == 0) continue;
          const double start_m = std::min(0.0, clearance_m(limits.shapes[k], first[part].position_m));
          least_m = std::min(least_m, clearance_m(limits.shapes[k], now[part].position_m) - start_m);
        }
      }
    }
  }
  return least_m;
}

class Workspace : public ::testing::TestWithParam<const char*> {};

TEST_P(Workspace, PlannedMotionsKeepToItAndRefusedOnesWouldNot) {
  std::mt19937_64 random(test::seed());
  const ArmModel free_arm = test::arm_of(GetParam());
  const test::WorkspaceCase draw{free_arm, random};
  int planned = 0, refused = 0;
  for (int i = 0; i < test::cases(200); ++i) {
    ArmModel arm = free_arm;
    arm.workspace.count = 1 + static_cast<std::uint32_t>(i % 5);
    for (std::size_t k = 0; k < arm.workspace.count; ++k) arm.workspace.shapes[k] = draw.shape();
    const PlanStart start{draw.joints(), 0.0};
    const PlanSettings settings = test::random_settings(
        free_arm, i, start, [&](double low, double high) { return draw.in(low, high); });
    const MotionRequest request = draw.request(i % 5, start);
    const PlanResult free = Planner(free_arm).plan(start, settings, request);
    const PlanResult kept = Planner(arm).plan(start, settings, request);
    if (std::holds_alternative<PlanRefusal>(free)) {
      ASSERT_TRUE(std::holds_alternative<PlanRefusal>(kept)) << i;
      continue;
    }
    const double free_m = least_clearance(free_arm, arm.workspace, free);
    if (std::holds_alternative<std::vector<Command>>(kept)) {
      ++planned;
      ASSERT_GE(least_clearance(free_arm, arm.workspace, kept), -kWorkspaceTolerance_m - 1e-12) << i;
    } else {
      ++refused;
      const auto& refusal = std::get<PlanRefusal>(kept);
      ASSERT_TRUE(refusal.parameter.starts_with("workspace: ")) << i << refusal.text;
      // The reference finds the breach, too, unless it is shallow and lies between two of its points.
      ASSERT_LT(refusal.value, refusal.lower - 0.4 * kWorkspaceTolerance_m) << i << refusal.text;
      ASSERT_LT(free_m, 1e-4) << i << refusal.text;
    }
  }
  EXPECT_GT(planned, 0);
  EXPECT_GT(refused, 0);
}

INSTANTIATE_TEST_SUITE_P(Arms, Workspace, ::testing::ValuesIn(test::kTestArms));

}  // namespace
}  // namespace corbot::property_workspace_test
