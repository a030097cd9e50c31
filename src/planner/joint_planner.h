// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <vector>

#include "corbot/arm/arm_model.h"
#include "planner/plan/plan.h"
#include "planner/request.h"

namespace corbot {

/// Plans synchronised joint-space motions: all joints take the same time. Arguments have been checked.
class JointPlanner {
 public:
  /// `model` and `settings` must outlive this.
  JointPlanner(const ArmModel& model, const PlanSettings& settings);

  /// Returns the speed limit in force, rad/s or m/s.
  [[nodiscard]] double speed_q_s(std::size_t joint) const noexcept { return speed_q_s_[joint]; }

  /// Plans a motion to given joint values.
  [[nodiscard]] PlanResult to(const PlanStart& start, const Joints& target_q, double t_s) const;
  /// Plans a motion to a point: on the present solution if joint ranges and workspace allow it, else on the
  /// quickest feasible one.
  [[nodiscard]] PlanResult reach(const PlanStart& start, const std::array<double, 3>& target_m,
                                 double t_s) const;
  /// Plans a motion of one joint, no faster than the request's speed.
  [[nodiscard]] PlanResult drive(const PlanStart& start, const DriveRequest& request) const;

 private:
  struct Way {
    double duration_s{};  ///< 0: before all others
    Joints target_q{};
  };

  [[nodiscard]] PlanResult first_inside(const PlanStart& start, std::vector<Way> ways, double t_s) const;
  [[nodiscard]] PlanResult reach_numerically(const PlanStart& start, const std::array<double, 3>& target_m,
                                             double t_s) const;

  const ArmModel& model_;
  const PlanSettings& settings_;
  Joints speed_q_s_{};
};

}  // namespace corbot
