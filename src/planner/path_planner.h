// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <optional>
#include <variant>
#include <vector>

#include "corbot/arm/arm_model.h"
#include "corbot/kinematics/arm_kinematics.h"
#include "planner/path_proof.h"
#include "planner/plan/plan.h"

namespace corbot {

struct PathPlan : std::variant<Command, PlanRefusal> {
  using variant::variant;
  PlannedRate rate;  ///< empty for a dwell
};

/// Plans lines and arcs of the tool centre point and proves each as a whole. Arguments have been checked.
class PathPlanner {
 public:
  /// `model` has the soft limits for ranges. `whole` has its own ranges, by which the real-time task selects
  /// the turns of joints. All arguments must outlive this.
  PathPlanner(const ArmModel& model, const ArmModel& whole, const PlanSettings& settings) noexcept
      : model_(model), whole_(whole), settings_(settings) {}

  [[nodiscard]] PathPlan line(const PlanStart& start, const std::array<double, 3>& to_m, double t_s) const;
  /// `arc` gives circle and angle; the function fills in the orientation.
  [[nodiscard]] PathPlan arc(const PlanStart& start, ArcMotion arc) const;

 private:
  [[nodiscard]] std::vector<std::uint32_t> present_solutions(const PathPoint& here, const Joints& q) const;
  /// `motion` has everything except orientation and solution.
  template <class Motion, class Member>
  [[nodiscard]] PathPlan plan(const PlanStart& start, Motion motion, double t_s, Member member) const;
  template <class Motion, class Member>
  [[nodiscard]] PathPlan plan_on_solution(const PlanStart& start, Motion motion, double t_s,
                                          Member member) const;
  template <class Motion>
  [[nodiscard]] std::optional<PlanRefusal> closed_form_refusal(const PlanStart& start,
                                                               const Motion& motion) const;
  [[nodiscard]] std::optional<PlanRefusal> check_ranges(const std::vector<rate::Knot>& knots,
                                                        const PathPoint& target) const;
  [[nodiscard]] PlanRefusal range_at_target(std::size_t joint, double position_q,
                                            const PathPoint& target) const;
  [[nodiscard]] std::optional<PlanRefusal> check_ends(const PlanStart& start, const PathProof& proof,
                                                      const PathPoint& target) const;
  [[nodiscard]] std::optional<PlanRefusal> check_start(const PlanStart& start, const IkSolution& first) const;

  const ArmModel& model_;
  const ArmModel& whole_;
  const PlanSettings& settings_;
};

}  // namespace corbot
