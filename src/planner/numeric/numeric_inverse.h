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

/// A pose is met within this (m, rad); what converges, converges to the noise of computing.
inline constexpr double kSolved = 1e-9;

/// Where and for how long to look.
struct NumericSearch {
  /// Seeds of sliding joints are drawn from here (m); rotary ones from the whole turn.
  Joints lower_q{};
  Joints upper_q{};
  std::uint32_t most_seeds{6000};
  std::uint32_t quiet_seeds{900};  ///< so many in a row without anything new: all are found
  std::uint64_t seed{1751};        ///< of the random numbers: the same pose has the same solutions
};

struct NumericSolutions {
  std::uint32_t count{};
  std::array<Joints, kMaxSolutions> joints_q{};  ///< rotary joints next to the hint; limits are not looked at
  std::uint32_t seeds{};                         ///< how many were tried
  /// Where count is 0: how near any seed came.
  double nearest_m{};
  double nearest_rad{};
};

/// Damped least squares (Sugihara, IEEE T-RO 27(5), 2011: damping by the squared error) from `joints_q` until the pose is met;
/// false, and joints as near as they came, where it is not. At most 80 steps of some microseconds; no allocation.
[[nodiscard]] bool refine(const JointChain& chain, const Pose& base_T_tool, Joints& joints_q) noexcept;

/// The first that is found, from the hint, then from random seeds.
[[nodiscard]] NumericSolutions first_solution(const JointChain& chain, const Pose& base_T_tool,
                                              const Joints& hint_q, const NumericSearch& search);

/// All that random seeds find, at most kMaxSolutions, as distinct modulo whole turns (1e-3 rad or m), in the order of their joints,
/// so that a number is the same for the same pose, whatever the hint. A pose where joints are free has infinitely many: then it is any of them.
/// Not for the cycle: it takes some 10 ms.
[[nodiscard]] NumericSolutions all_solutions(const JointChain& chain, const Pose& base_T_tool,
                                             const Joints& hint_q, const NumericSearch& search);
/// … of this arm, its slides sought in their ranges.
[[nodiscard]] NumericSolutions all_solutions(const ArmModel& model, const Pose& base_T_tool,
                                             const Joints& hint_q);

/// The same for a point of a path: of an arm of fewer than six joints its position, and the angles that the arm follows.
[[nodiscard]] bool refine(const Kinematics& arm, const PathPoint& point, Joints& joints_q) noexcept;
[[nodiscard]] NumericSolutions all_solutions(const ArmModel& model, const PathPoint& point,
                                             const Joints& hint_q);

}  // namespace corbot::numeric
