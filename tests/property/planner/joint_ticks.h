// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <gtest/gtest.h>

#include <cmath>

#include "corbot/arm/arm_model.h"
#include "corbot/motion/bounds.h"
#include "corbot/motion/law_evaluation.h"
#include "planner/plan/plan.h"

// A joint motion run at 1 kHz as the real-time task runs it, looked at in every tick.

namespace corbot::test {

inline void check_ticks(const ArmModel& arm, const PlanSettings& settings, const Command& command) {
  constexpr double kTick_s = 1e-3;
  constexpr double kSlack = 1.0 + 1e-9;
  const int ticks = static_cast<int>(std::ceil(command.duration_s / kTick_s));
  for (std::size_t i = 0; i < arm.dof; ++i) {
    const TimeLaw& law = command.joint.law[i];
    const JointLimits& limits = arm.joints[i];
    const double speed = limits.speed_q_s * settings.speed_ratio * settings.joint_speed_ratio[i];
    double last = command.start_q[i];
    for (int k = 0; k <= ticks; ++k) {
      const LawState s = evaluate(law, k * kTick_s);
      const double q = command.start_q[i] + s.position;
      ASSERT_GE(q, limits.lower_q - kRangeTolerance_q);
      ASSERT_LE(q, limits.upper_q + kRangeTolerance_q);
      ASSERT_LE(std::abs(s.velocity), speed * kSlack);
      ASSERT_LE(std::abs(q - last), speed * kTick_s * kSlack + 1e-15);
      ASSERT_LE(std::abs(s.acceleration), limits.acceleration_q_s2 * kSlack);
      ASSERT_LE(std::abs(s.jerk), limits.jerk_q_s3 * kSlack);
      last = q;
    }
    ASSERT_EQ(command.start_q[i] + evaluate(law, command.duration_s).position, command.end_q[i]);
    ASSERT_NEAR(law.duration_s(), command.duration_s, 1e-12 * command.duration_s) << "joints end together";
  }
}

}  // namespace corbot::test
