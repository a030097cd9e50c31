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
  std::vector<PathKnot> knots;  ///< of an arm without a closed form
  PlannedRate rate;             ///< of a line with a rate
};

/// What the law of a path must keep to, per unit of the path parameter; and the curvature, 0 for a line.
struct PathScale {
  double length_m{};
  double rotation_rad{};
  double curvature_1_m{};
};

/// Lines and arcs of the tool centre point, each proved whole. Arguments have been checked.
class PathPlanner {
 public:
  /// `model`: with the soft limits for ranges; `whole`: with its own, by which the real-time task chooses the turns of joints.
  /// All must outlive this.
  PathPlanner(const ArmModel& model, const ArmModel& whole, const PlanSettings& settings, PathTiming timing);

  [[nodiscard]] PathPlan line(const PlanStart& start, const std::array<double, 3>& to_m, double t_s) const;
  /// `arc`: circle and angle; the orientation is filled in.
  [[nodiscard]] PathPlan arc(const PlanStart& start, ArcMotion arc) const;

 private:
  [[nodiscard]] std::vector<std::uint32_t> present_solutions(const PathPoint& here, const Joints& q) const;
  /// `motion`: everything but orientation, solution and law.
  template <class Motion, class Member>
  [[nodiscard]] PathPlan plan(const PlanStart& start, Motion motion, double t_s, Member member) const;
  template <class Motion, class Member>
  [[nodiscard]] PathPlan plan_by_law(const PlanStart& start, const Motion& motion, double t_s,
                                     Member member) const;
  template <class Motion, class Member>
  [[nodiscard]] PathPlan plan_on_solution(const PlanStart& start, Motion motion, double t_s,
                                          Member member) const;
  template <class Motion, class Member>
  [[nodiscard]] PathPlan plan_between_knots(const PlanStart& start, Motion motion, double t_s,
                                            Member member) const;
  template <class Motion, class Member>
  [[nodiscard]] PathPlan plan_proved(const PlanStart& start, Motion motion, const PathProof& proof,
                                     double t_s, Member member) const;
  template <class Motion, class Member>
  [[nodiscard]] PathPlan plan_with_rate(const PlanStart& start, Motion motion, double t_s,
                                        Member member) const;
  [[nodiscard]] std::optional<PlanRefusal> check_ranges(const std::vector<rate::Knot>& knots,
                                                        const PathPoint& target) const;
  [[nodiscard]] PlanRefusal range_at_target(std::size_t joint, double position_q,
                                            const PathPoint& target) const;
  [[nodiscard]] std::optional<PlanRefusal> check_ends(const PlanStart& start, const PathProof& proof,
                                                      const PathPoint& target) const;
  [[nodiscard]] std::optional<PlanRefusal> check_start(const PlanStart& start, const IkSolution& first) const;
  [[nodiscard]] TimeLaw fastest_law(const PathProof& proof, const PathScale& scale) const;

  const ArmModel& model_;
  const ArmModel& whole_;
  const PlanSettings& settings_;
  PathTiming timing_;
  Joints joint_speed_{};
};

}  // namespace corbot
