// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>

#include "corbot/arm/arm_model.h"
#include "corbot/kinematics/closed_form.h"
#include "corbot/kinematics/joint_chain.h"
#include "corbot/kinematics/pose.h"
#include "corbot/motion/path.h"

namespace corbot::numeric {

/// The solver meets a pose within this (m, rad). A converged solution is accurate to rounding error.
inline constexpr double kSolved = 1e-9;

/// The range and the extent of a search.
struct NumericSearch {
  /// Range of the seeds of sliding joints (m). Seeds of rotary joints cover the whole turn.
  Joints lower_q{};
  Joints upper_q{};
  std::uint32_t most_seeds{6000};
  std::uint32_t quiet_seeds{900};  ///< the search ends after this number of seeds without a new solution
  std::uint64_t seed{1751};        ///< of the random numbers: the same pose gives the same solutions
};

struct NumericSolutions {
  std::uint32_t count{};
  std::array<Joints, kMaxSolutions> joints_q{};  ///< rotary joints next to the hint; limits do not apply
  std::uint32_t seeds{};                         ///< number of seeds tried
  /// The least error of any seed, if count is 0.
  double nearest_m{};
  double nearest_rad{};
};

/// Improves `joints_q` by damped least squares until the pose is met. Returns false if it is not met; the
/// joints are then at their best values. The damping is the squared error (Sugihara, IEEE T-RO 27(5), 2011).
/// At most 80 steps of some microseconds each; no allocation.
[[nodiscard]] bool refine(const JointChain& chain, const Pose& base_T_tool, Joints& joints_q) noexcept;

/// Returns the first solution found, from the hint, then from random seeds.
[[nodiscard]] NumericSolutions first_solution(const JointChain& chain, const Pose& base_T_tool,
                                              const Joints& hint_q, const NumericSearch& search);

/// Returns all solutions that random seeds find, at most kMaxSolutions. They are distinct modulo whole turns
/// (1e-3 rad or m). Their order depends on the joints alone: a solution at a pose has the same number with
/// any hint. At a pose with free joints there are infinitely many solutions; the result then contains some of
/// them. Not for the cycle: the search takes some 10 ms.
[[nodiscard]] NumericSolutions all_solutions(const JointChain& chain, const Pose& base_T_tool,
                                             const Joints& hint_q, const NumericSearch& search);
/// Does the same for this arm, with the seeds of sliding joints within their ranges.
[[nodiscard]] NumericSolutions all_solutions(const ArmModel& model, const Pose& base_T_tool,
                                             const Joints& hint_q);

/// Do the same for a point of a path. With fewer than six joints the goal is the position and the angles that
/// the arm follows.
[[nodiscard]] bool refine(const Kinematics& arm, const PathPoint& point, Joints& joints_q) noexcept;
[[nodiscard]] NumericSolutions all_solutions(const ArmModel& model, const PathPoint& point,
                                             const Joints& hint_q);

}  // namespace corbot::numeric
