// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include "corbot/arm/arm_model.h"
#include "corbot/motion/path.h"
#include "rt/cycle/rate_check.h"

namespace corbot::rt {

/// Checks a set-point on a path by the arm's kinematics. The forward kinematics must put the tool on the
/// path. If the arm has a closed form, the inverse must have the set-point among its solutions for the path's
/// point. Next to a singularity a tiny motion of the tool moves joints far, and nothing is compared.
/// Real-time safe.
class PathCheck {
 public:
  static constexpr double kTracking = RateCheck::kTracking;  ///< m and rad
  static constexpr double kLeastPivot = 0.02;                ///< of the task matrix, see least_pivot()
  static constexpr double kInverse_q = 5e-4;                 ///< rad and m

  /// `solution`: the solution at the path's beginning. A path through a singularity goes on on another one.
  void begin(std::uint32_t solution) noexcept { solution_ = solution; }
  [[nodiscard]] bool agrees(const Kinematics& arm, const PathPoint& point, const Joints& q) noexcept;

 private:
  std::uint32_t solution_{0};
};

}  // namespace corbot::rt
