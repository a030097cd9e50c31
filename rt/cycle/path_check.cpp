// SPDX-License-Identifier: Apache-2.0
#include "rt/cycle/path_check.h"

#include "corbot/kinematics/path_form.h"
#include "corbot/motion/path_joints.h"

namespace corbot::rt {

bool PathCheck::agrees(const Kinematics& arm, const PathPoint& point, const Joints& q) noexcept {
  if (!(tool_deviation(arm, q, point) <= kTracking)) return false;
  if (!arm.has_closed_form() || least_pivot(arm, q) < kLeastPivot) return true;
  const auto is_at = [&](std::uint32_t number) {
    const IkSolution ik = inverse_at(arm, point, number, q);
    return ik.status == IkStatus::kOk && arm.same(ik.joints_q, q, kInverse_q);
  };
  if (is_at(solution_)) return true;
  for (std::uint32_t number = 0; arm.has_solution(number); ++number) {
    if (!is_at(number)) continue;
    solution_ = number;
    return true;
  }
  return false;
}

}  // namespace corbot::rt
