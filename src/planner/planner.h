// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <optional>

#include "corbot/arm/arm_model.h"
#include "planner/plan/plan.h"
#include "planner/request.h"

namespace corbot {

/// Plans whole motions from rest to rest and proves them before anything moves. `t_s` = 0 requests the
/// shortest time that the limits allow; a time that is too short for the limits is extended. Stateless and
/// thread-safe.
class Planner {
 public:
  explicit Planner(const ArmModel& model) : model_(model) {}

  [[nodiscard]] const ArmModel& model() const { return model_; }

  /// Checks the arguments that do not depend on the arm's position: names, finite numbers, ranges, speeds.
  [[nodiscard]] std::optional<PlanRefusal> check(const PlanSettings& settings,
                                                 const MotionRequest& request) const;
  /// Checks the arguments and plans with one of the following functions, by the request's kind.
  [[nodiscard]] PlanResult plan(const PlanStart& start, const PlanSettings& settings,
                                const MotionRequest& request) const;

  /// Plans a free, synchronised joint motion to the point. Keeps the present solution if its joint ranges
  /// allow, else takes the quickest feasible one.
  [[nodiscard]] PlanResult move(const PlanStart& start, const PlanSettings& settings,
                                const std::array<double, 3>& target_m, double t_s) const;
  /// Plans a straight line of the TCP, on the present solution.
  [[nodiscard]] PlanResult move_s(const PlanStart& start, const PlanSettings& settings,
                                  const std::array<double, 3>& target_m, double t_s) const;
  /// Plans an arc p1 → p2 → p3. If the TCP is not at p1, a line to p1 precedes.
  [[nodiscard]] PlanResult move_c(const PlanStart& start, const PlanSettings& settings,
                                  const std::array<double, 3>& p1_m, const std::array<double, 3>& p2_m,
                                  const std::array<double, 3>& p3_m) const;
  /// Plans a synchronised joint motion to given joint values.
  [[nodiscard]] PlanResult move_joints(const PlanStart& start, const PlanSettings& settings,
                                       const Joints& target_q, double t_s) const;
  /// Plans a motion of one joint by an increment, at its own speed.
  [[nodiscard]] PlanResult drive(const PlanStart& start, const PlanSettings& settings, int joint,
                                 double increment_q, double speed_q_s) const;
  /// Plans a motion of all joints to 0.
  [[nodiscard]] PlanResult ready(const PlanStart& start, const PlanSettings& settings) const;
  /// Plans a time at rest.
  [[nodiscard]] PlanResult dwell(const PlanStart& start, double t_s) const;
  /// Plans a gripper motion to an opening, 0 closed … 1 open.
  [[nodiscard]] PlanResult gripper(const PlanStart& start, double opening) const;

 private:
  ArmModel model_;
};

}  // namespace corbot
