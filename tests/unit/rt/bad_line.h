// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <memory>
#include <stdexcept>
#include <variant>
#include <vector>

#include "corbot/kinematics/tool_pose.h"
#include "corbot/motion/rate_knots.h"
#include "planner/planner.h"
#include "rt/rig.h"

namespace corbot::test {

/// A line that passes the task's gate and then leaves a joint's range. The elbow bends most between two of
/// the points that the gate checks, and the range of `arm` ends there. No planner would give it out.
struct BadLine {
  ArmModel arm = shipped_lynx5();
  Joints from_q{-0.5, 0.9, 1.2, 0.6};
  PlanResult plan;

  BadLine() {
    const Vector3 from_m = arm.kinematics.forward(from_q).position_m;
    PlanSettings settings;
    settings.tool_pitch_rad = pitch_of_angle(arm.kinematics, arm.kinematics.followed().at(from_q)[0]);
    for (double by_m = 0.15; by_m < 0.25; by_m += 0.005) {
      plan = Planner(arm).move_s({from_q, 0.0}, settings, from_m + Vector3{0.0, by_m, 0.0}, 0.0);
      if (std::holds_alternative<std::vector<Command>>(plan) && narrow()) return;
    }
    throw std::logic_error("no line bends the elbow most between the points that the gate looks at");
  }
  /// A task that has the arm at the beginning of the line.
  void begin(Rig& rig) const {
    rig.arm = arm;
    rig.task = std::make_unique<TaskSegment>();
    rig.servant = std::make_unique<ServantSegment>();
    rig.restart({.position_q = from_q, .position_known = true});
    rig.step();
    rig.submit(plan);
  }

 private:
  /// False where the elbow's greatest angle is at one of these points.
  bool narrow() {
    constexpr double kClear_q = 2e-5;
    constexpr std::size_t kElbow = 2;
    const std::vector<rate::Knot>& knots = plan.rates.front().knots;
    double looked_at_q = -1e9, most_q = -1e9;
    for (std::size_t k = 0; k + 1 < knots.size(); ++k) {
      const rate::Cell cell(knots[k], knots[k + 1]);
      for (int n = 0; n <= 64; ++n) {
        const double q = cell.at(n / 64.0)[kElbow];
        most_q = std::max(most_q, q);
        if (n % 64 == 0 || n == 16 || n == 48) looked_at_q = std::max(looked_at_q, q);
      }
    }
    if (most_q < looked_at_q + kClear_q) return false;
    arm.joints[kElbow].upper_q = 0.5 * (looked_at_q + most_q);
    return true;
  }
};

}  // namespace corbot::test
