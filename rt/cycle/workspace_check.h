// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>

#include "corbot/arm/arm_model.h"
#include "corbot/kinematics/arm_parts.h"
#include "rt/cycle/set_point_check.h"

namespace corbot::rt {

/// Checks every set-point of a command against the arm's workspace, in the command's frames. The planner has
/// proved the same at every instant. A part that is beyond a shape when the command begins may go no farther
/// beyond. Costs nothing without a workspace. Real-time safe.
class WorkspaceCheck {
 public:
  /// Exceeds the planner's tolerance, or a motion that the planner has proved would end here.
  static constexpr double kTolerance_m = 2.0 * kWorkspaceTolerance_m;

  /// `arm` has the frames of the command that begins.
  void begin(const ArmModel& arm, const Joints& rest_q) noexcept;
  [[nodiscard]] SetPointVerdict see(const ArmModel& arm, const Joints& next_q) const noexcept;

 private:
  ArmPoints points_{};
  ArmParts parts_{};
  std::array<std::array<double, kArmParts>, WorkspaceLimits::kMostShapes> least_m_{};  ///< allowed
};

}  // namespace corbot::rt
