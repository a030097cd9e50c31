// SPDX-License-Identifier: Apache-2.0
// Converts plans to the records of corbot_robot.h.
#include <algorithm>
#include <iterator>

#include "corbot/arm/joint_units.h"
#include "robot/recorded_call.h"

namespace corbot {
namespace {

static_assert(static_cast<int>(rate::Mover::kJoint) == CORBOT_OWNER_JOINT);
static_assert(static_cast<int>(rate::Mover::kToolTravel) == CORBOT_OWNER_TOOL);
static_assert(static_cast<int>(rate::Mover::kToolTurn) == CORBOT_OWNER_TOOL_TURN);
static_assert(static_cast<int>(rate::LimitKind::kSpeed) == CORBOT_LIMIT_SPEED);
static_assert(static_cast<int>(rate::LimitKind::kAcceleration) == CORBOT_LIMIT_ACCELERATION);
static_assert(static_cast<int>(rate::LimitKind::kJerk) == CORBOT_LIMIT_JERK);

corbot_plan_stretch shown(const rate::ReasonStretch& stretch) {
  const rate::Reason& reason = stretch.reason;
  const bool is_joint = reason.mover == rate::Mover::kJoint;
  return {stretch.begin_s,
          stretch.end_s,
          static_cast<int32_t>(reason.mover),
          is_joint ? static_cast<int32_t>(reason.joint) : -1,
          static_cast<int32_t>(reason.limit),
          stretch.share};
}

corbot_plan_part shown(const rate::PlanPart& from) {
  corbot_plan_part to{};
  to.duration_s = from.duration_s;
  to.stretch_count = std::min<std::size_t>(from.stretches.size(), CORBOT_MAX_STRETCHES);
  std::transform(from.stretches.begin(),
                 from.stretches.begin() + static_cast<std::ptrdiff_t>(to.stretch_count),
                 std::begin(to.stretches), [](const rate::ReasonStretch& stretch) { return shown(stretch); });
  if (!from.nearest) return to;
  to.has_pivot = 1;
  to.least_pivot = from.nearest->pivot;
  std::copy(from.nearest->point_m.begin(), from.nearest->point_m.end(), std::begin(to.pivot_point_m));
  return to;
}

}  // namespace

corbot_plan shown(const MotionPlan& plan, const Kinematics& arm) {
  corbot_plan to{};
  for (std::size_t i = 0; i < arm.joint_count(); ++i) {
    to.start[i] = to_shown(arm.joint_kind(i), plan.start_q[i]);
    to.end[i] = to_shown(arm.joint_kind(i), plan.end_q[i]);
  }
  if (plan.parts.size() > CORBOT_MAX_PARTS) throw internal("the planner returned too many commands");
  for (const rate::PlanPart& part : plan.parts) to.parts[to.part_count++] = shown(part);
  return to;
}

}  // namespace corbot
