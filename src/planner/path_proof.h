// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <optional>
#include <variant>

#include "corbot/arm/arm_model.h"
#include "corbot/kinematics/arm_kinematics.h"
#include "corbot/kinematics/planar_stretch.h"
#include "corbot/motion/command.h"
#include "corbot/motion/path.h"
#include "planner/plan/plan.h"

namespace corbot {

/// Proves that the closed form leads along a whole line or arc on one solution, between samples, too. A
/// refusal says why a path has no knots, and names joint and point.
///
/// The path parameter is cut into cells. Each cell has bounds of the joint values and their derivatives that
/// hold for *every* point in it. They follow from the cell's middle and from bounds of the derivatives
/// (kinematics/planar_stretch.h, path_form.h). A cell that is neither proved nor refuted is halved. A cell is
/// refuted if its middle, a point of the path, breaks a limit.
///
/// Halving ends at 1e-9 of the path or 1e-12 m of travel. There the joint values at the two ends are compared
/// instead (sampling, not proof). A path may therefore begin or end on the border of the workspace, where
/// bounds are infinite. A violation hidden in such a cell is below the tolerances of reach and range, as both
/// are continuous with bounded curvature.
class PathProof {
 public:
  /// `start_q`: joints at the start. The proof follows no whole turns: a rotary joint's range counts as cut
  /// to one turn (motion/path_joints.h). `soft_limits` apply besides the model's ranges. They select no turn,
  /// as the real-time task does not know them. The model must outlive this.
  PathProof(const ArmModel& model, const LineMotion& line, const Joints& start_q,
            const std::optional<JointRanges>& soft_limits = {});
  PathProof(const ArmModel& model, const ArcMotion& arc, const Joints& start_q,
            const std::optional<JointRanges>& soft_limits = {});

  /// Returns the joint values at s by the closed form, each at the turn that the path keeps.
  [[nodiscard]] IkSolution joints_at(double s) const noexcept;

  /// Proves reach, joint ranges and an unbroken θ0 over the whole path. Returns nullopt if all hold.
  [[nodiscard]] std::optional<PlanRefusal> check_geometry() const;

  /// If joints are beyond their ranges at s, returns the singularity before s at which they jump; else
  /// nullopt.
  [[nodiscard]] std::optional<PlanRefusal> singularity_before(double s) const;

  /// Returns a value beyond its range as a protractor shows it, for a refusal.
  [[nodiscard]] double shown(std::size_t joint, double value_q) const noexcept;

 private:
  /// Constants of the whole path.
  struct Constants {
    Vector3 turn_rad{};  ///< of the tool, or rates of the followed angles; per unit of s
    double bend_m{};     ///< bound of |d²(position)/ds²|
    double travel_m{};   ///< bound of |d(position)/ds| + hand's length·|turn|
  };
  /// Bounds on one cell; infinite if its middle is out of reach.
  struct Cell {
    IkSolution middle;
    CellRates rates;
  };
  [[nodiscard]] PathPoint point(double s) const noexcept;
  [[nodiscard]] std::array<double, 3> derivative(double s) const noexcept;
  [[nodiscard]] Cell bound(double s_a, double s_b) const noexcept;
  [[nodiscard]] bool is_smallest(double s_a, double s_b) const noexcept;
  [[nodiscard]] std::optional<PlanRefusal> check_ends(double s_a, double s_b) const;
  void cut_limits(const std::optional<JointRanges>& soft_limits) noexcept;
  /// Returns true if the half turn, not the range, is the limit of the joint on this side.
  [[nodiscard]] bool is_cut_by_turn(std::size_t joint, double position_q) const noexcept;
  [[nodiscard]] PlanRefusal leaves_range(std::size_t joint, double position_q, double s) const;

  const ArmModel* model_;
  std::variant<LineMotion, ArcMotion> path_;
  std::uint32_t solution_;
  Joints start_q_;
  Constants constants_;
  std::array<JointLimits, kMaxJoints> ranges_;    ///< with the soft limits
  std::array<JointLimits, kMaxJoints> limits_{};  ///< the same, cut to one turn
};

}  // namespace corbot
