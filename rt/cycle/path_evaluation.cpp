// SPDX-License-Identifier: Apache-2.0
#include "rt/cycle/path_evaluation.h"

#include <algorithm>

#include "corbot/motion/law_evaluation.h"

namespace corbot::rt {
namespace {

void add_law(GovernedMotion& motion, const GovernedLaw& law) noexcept {
  // A law that moves nothing restricts nothing.
  if (law.law.jerk(0) != 0.0) motion.laws[motion.count++] = law;
}

}  // namespace

void take_frames(const Command& command, Kinematics& arm) noexcept {
  const auto take = [&arm](const Frames& frames) { arm.set_frames(frames.base_T_0, frames.n_T_tool); };
  if (command.kind == MotionKind::kJoint) take(command.joint.frames);
  if (command.kind == MotionKind::kLine) take(command.line.frames);
  if (command.kind == MotionKind::kArc) take(command.arc.frames);
}

SetPoint evaluate_command(const ArmModel& arm, const Command& command, const SetPoint& base,
                          double time_s) noexcept {
  SetPoint set_point = base;
  switch (command.kind) {
    case MotionKind::kJoint:
      for (std::size_t i = 0; i < std::min<std::size_t>(arm.dof, kMaxJoints); ++i) {
        set_point.position_q[i] += evaluate(command.joint.law[i], time_s).position;
      }
      break;
    case MotionKind::kGripper:
      set_point.opening += evaluate(command.gripper.law, time_s).position;
      break;
    case MotionKind::kLine:
    case MotionKind::kArc:
    case MotionKind::kDwell:
      break;
  }
  return set_point;
}

GovernedMotion governed_motion(const ArmModel& arm, const Command& command) noexcept {
  GovernedMotion motion;
  motion.duration_s = command.duration_s;
  switch (command.kind) {
    case MotionKind::kJoint:
      for (std::size_t i = 0; i < std::min<std::size_t>(arm.dof, kMaxJoints); ++i) {
        const JointLimits& limits = arm.joints[i];
        add_law(motion, {LawSegments(command.joint.law[i]), limits.acceleration_q_s2, limits.jerk_q_s3});
      }
      break;
    case MotionKind::kGripper: {
      const LawPeaks peak = peaks(command.gripper.law);
      add_law(motion, {LawSegments(command.gripper.law), peak.acceleration, peak.jerk});
      break;
    }
    case MotionKind::kLine:
    case MotionKind::kArc:
    case MotionKind::kDwell:
      break;
  }
  return motion;
}

void publish_set_point(const ArmModel& arm, const SetPoint& now, const SetPoint& before,
                       Snapshot& snapshot) noexcept {
  const double period_s = static_cast<double>(arm.period_ns) * 1e-9;
  snapshot.gripper = now.opening;
  snapshot.position_q = now.position_q;
  for (std::size_t i = 0; i < kMaxJoints; ++i)
    snapshot.velocity_q_s[i] = (now.position_q[i] - before.position_q[i]) / period_s;
  snapshot.tool = arm.kinematics.forward(now.position_q);
}

}  // namespace corbot::rt
