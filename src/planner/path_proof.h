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

/// Whether the closed form leads along a whole line or arc on one solution, proved between the samples. It says why a path has no knots, and
/// names joint and point.
///
/// The path parameter is cut into cells. On each cell, bounds that hold for *every* point of it are computed
/// from its middle and from bounds of the derivatives (kinematics/planar_stretch.h, path_form.h): of the joint
/// values and their derivatives. A cell that is neither proved nor refuted is
/// halved. Refuted means that its middle, a point of the path, breaks a limit.
///
/// Cells are no longer halved at 1e-9 of the path or 1e-12 m of travel; there the joint values at the two
/// ends are compared instead (sampling, not proof). So a path may begin or end on the border of the workspace, where
/// bounds are infinite. A violation hidden in such a cell is below the tolerances of reach and range, because reach and range are
/// continuous and bend boundedly.
class PathProof {
 public:
  /// `start_q`: the joints at the start. Whole turns are not followed: a rotary joint's range counts as cut
  /// to one turn (motion/path_joints.h). The model must outlive this.
  /// `soft_limits`: kept besides the model's ranges. They choose no turn, as the real-time task does not know them.
  PathProof(const ArmModel& model, const LineMotion& line, const Joints& start_q,
            const std::optional<JointRanges>& soft_limits = {});
  PathProof(const ArmModel& model, const ArcMotion& arc, const Joints& start_q,
            const std::optional<JointRanges>& soft_limits = {});

  /// Joint values at s by the closed form, each at the turn that the path keeps.
  [[nodiscard]] IkSolution joints_at(double s) const noexcept;

  /// Proves reach, joint ranges and an unbroken θ0 over the whole path; nullopt when all hold.
  [[nodiscard]] std::optional<PlanRefusal> check_geometry() const;

  /// Where joints are beyond their ranges at s: the singularity before it at which they jump; nullopt where they do not.
  [[nodiscard]] std::optional<PlanRefusal> singularity_before(double s) const;

  /// A value beyond its range as a protractor shows it, for a refusal.
  [[nodiscard]] double shown(std::size_t joint, double value_q) const noexcept;

 private:
  /// The whole path's constants.
  struct Constants {
    Vector3 turn_rad{};  ///< of the tool, or rates of the followed angles; a unit of s
    double bend_m{};     ///< bound of |d²(position)/ds²|
    double travel_m{};   ///< bound of |d(position)/ds| + hand's length·|turn|
  };
  /// Bounds on one cell; infinite where its middle is out of reach.
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
  /// Is it the half turn, and not the range, that ends on this side what the joint may take?
  [[nodiscard]] bool is_cut_by_turn(std::size_t joint, double position_q) const noexcept;
  [[nodiscard]] PlanRefusal leaves_range(std::size_t joint, double position_q, double s) const;

  const ArmModel* model_;
  std::variant<LineMotion, ArcMotion> path_;
  std::uint32_t solution_;
  Joints start_q_;
  Constants constants_;
  std::array<JointLimits, kMaxJoints> ranges_;    ///< with the soft ones
  std::array<JointLimits, kMaxJoints> limits_{};  ///< the same, cut to one turn
};

}  // namespace corbot
