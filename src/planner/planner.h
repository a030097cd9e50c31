// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <optional>

#include "corbot/arm/arm_model.h"
#include "planner/plan/plan.h"
#include "planner/request.h"

namespace corbot {

/// Plans whole motions from rest to rest and proves them before anything moves. Stateless and thread-safe.
/// `t_s` = 0 asks for the shortest time the limits allow;
/// a t_s the limits forbid stretches to what they allow.
class Planner {
 public:
  explicit Planner(const ArmModel& model) : model_(model) {}

  [[nodiscard]] const ArmModel& model() const { return model_; }

  /// The arguments alone, which need not know where the arm is: names, finite numbers, ranges, speeds.
  [[nodiscard]] std::optional<PlanRefusal> check(const PlanSettings& settings,
                                                 const MotionRequest& request) const;
  /// Checks the arguments and plans, by the request's kind one of the following.
  [[nodiscard]] PlanResult plan(const PlanStart& start, const PlanSettings& settings,
                                const MotionRequest& request) const;

  /// Free, synchronised joint motion to the point. The present solution is kept where its joint ranges allow,
  /// otherwise the quickest feasible one is taken.
  [[nodiscard]] PlanResult move(const PlanStart& start, const PlanSettings& settings,
                                const std::array<double, 3>& target_m, double t_s) const;
  /// Straight line of the TCP, on the present solution.
  [[nodiscard]] PlanResult move_s(const PlanStart& start, const PlanSettings& settings,
                                  const std::array<double, 3>& target_m, double t_s) const;
  /// Arc p1 → p2 → p3; if the TCP is not at p1, a line to p1 first.
  [[nodiscard]] PlanResult move_c(const PlanStart& start, const PlanSettings& settings,
                                  const std::array<double, 3>& p1_m, const std::array<double, 3>& p2_m,
                                  const std::array<double, 3>& p3_m) const;
  /// Synchronised joint motion to given joints.
  [[nodiscard]] PlanResult move_joints(const PlanStart& start, const PlanSettings& settings,
                                       const Joints& target_q, double t_s) const;
  /// One joint by an increment, at a speed of its own.
  [[nodiscard]] PlanResult drive(const PlanStart& start, const PlanSettings& settings, int joint,
                                 double increment_q, double speed_q_s) const;
  /// All joints to 0.
  [[nodiscard]] PlanResult ready(const PlanStart& start, const PlanSettings& settings) const;
  /// Stand still.
  [[nodiscard]] PlanResult dwell(const PlanStart& start, double t_s) const;
  /// Gripper to an opening, 0 closed … 1 open.
  [[nodiscard]] PlanResult gripper(const PlanStart& start, double opening) const;

 private:
  ArmModel model_;
};

}  // namespace corbot
