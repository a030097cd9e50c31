// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include "corbot/arm/arm_model.h"
#include "corbot/motion/path.h"
#include "rt/cycle/rate_check.h"

namespace corbot::rt {

/// Whether the arm's kinematics say of a set-point what its path says. The forward kinematics must put the tool on the path. The inverse, of an
/// arm that has a closed form, must have the set-point among its solutions for the path's point; next to a singularity, where a hair of the
/// tool's place moves joints far, nothing is compared. Real-time safe.
class PathCheck {
 public:
  static constexpr double kTracking = RateCheck::kTracking;  ///< m and rad
  static constexpr double kLeastPivot = 0.02;                ///< of the task matrix, see least_pivot()
  static constexpr double kInverse_q = 5e-4;                 ///< rad and m

  /// `solution`: where the path begins. One that leads through a singularity goes on on another.
  void begin(std::uint32_t solution) noexcept { solution_ = solution; }
  [[nodiscard]] bool agrees(const Kinematics& arm, const PathPoint& point, const Joints& q) noexcept;

 private:
  std::uint32_t solution_{0};
};

}  // namespace corbot::rt
