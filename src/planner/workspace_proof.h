// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <span>

#include "corbot/arm/arm_model.h"
#include "corbot/motion/command.h"
#include "corbot/motion/rate_knots.h"
#include "planner/plan/plan.h"

// The proof that the guarded parts of an arm keep to its workspace at every instant of a motion.
//
// A motion is cut into stretches. In a stretch a face's clearance c obeys
//     c >= c(middle) - |c'(middle)|·h - C·h²/2,
// with h the half length and C a bound of |c''|. C follows from bounds of the joints' first and second
// derivatives, and from each point's lever arms. A stretch that is neither proved nor refuted is halved.
// For a link this holds at both ends. Beside the edge of a box, h·|p'(middle)| replaces the second term.

namespace corbot {

/// Proves a joint motion. A part that stands beyond a shape may go no farther beyond. Returns nullopt if the
/// whole motion keeps to the workspace, or if the arm has none. `start_q`: joints at the beginning.
[[nodiscard]] std::optional<PlanRefusal> check_workspace(const ArmModel& model, const Joints& start_q,
                                                         const JointMotion& motion, double duration_s);

/// The same for a line or an arc between knots, as the task follows it.
[[nodiscard]] std::optional<PlanRefusal> check_workspace(const ArmModel& model,
                                                         std::span<const rate::Knot> knots);

/// Returns true for a refusal by check_workspace.
[[nodiscard]] bool leaves_workspace(const PlanRefusal& refusal);

}  // namespace corbot
