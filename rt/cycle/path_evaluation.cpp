// SPDX-License-Identifier: Apache-2.0
#include "rt/cycle/path_evaluation.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "corbot/motion/law_evaluation.h"
#include "corbot/motion/path_joints.h"

namespace corbot::rt {
namespace {

template <class Path>
void evaluate_path(const ArmModel& arm, const Path& path, double time_s, PathKnots knots,
                   SetPoint& set_point) noexcept {
  const double s = evaluate(path.law, time_s).position;
  if (!knots.empty()) {
    set_point.position_q = joints_at(knots, s);
    return;
  }
  const PathPoint point = point_at(path, s);
  const IkSolution ik = joints_at(arm, point, path.solution, set_point.position_q);
  set_point.reachable = ik.status == IkStatus::kOk;
  if (set_point.reachable) set_point.position_q = ik.joints_q;
}

/// Limits of the path parameter: those of the travel and those of the tool's rotation, whichever is narrower.
/// A path that goes nowhere is bounded by nothing.
double parameter_limit(double along, double length, double rotating, double rotation_rad) noexcept {
  const double by_length = length > 0.0 ? along / length : std::numeric_limits<double>::infinity();
  const double by_rotation =
      rotation_rad > 0.0 ? rotating / rotation_rad : std::numeric_limits<double>::infinity();
  return std::min(by_length, by_rotation);
}

GovernedLaw governed_path(const PathLimits& limits, const TimeLaw& law, double length, double rotation_rad,
                          double acceleration_m_s2, double jerk_m_s3) noexcept {
  return {LawSegments(law),
          parameter_limit(acceleration_m_s2, length, limits.rotation_acceleration_rad_s2, rotation_rad),
          parameter_limit(jerk_m_s3, length, limits.rotation_jerk_rad_s3, rotation_rad)};
}

GovernedLaw governed_line(const PathLimits& limits, const LineMotion& line) noexcept {
  return governed_path(limits, line.law, length_m(line), rotation_rad(line.tool), limits.acceleration_m_s2,
                       limits.jerk_m_s3);
}

/// √(a² − b²), 0 where that does not exist.
double leg(double a, double b) noexcept { return std::sqrt(std::max(0.0, (a - b) * (a + b))); }

/// On an arc the limits are those of the vector: v²/R towards the centre besides the acceleration along, and
/// (j + v³/R², 3 v a/R) for the jerk. What is left for the part along, at the law's greatest speed, and never
/// less than what the law itself takes.
GovernedLaw governed_arc(const PathLimits& limits, const ArcMotion& arc) noexcept {
  const double length = length_m(arc);
  const LawPeaks peak = peaks(arc.law);
  const double v = peak.velocity * length;
  const double angular_rate = v / arc.radius_m;
  const double centripetal_jerk = v * angular_rate * angular_rate;
  const double half_jerk = std::max(peak.jerk * length, 0.5 * limits.jerk_m_s3);
  const double across = leg(limits.jerk_m_s3, std::min(limits.jerk_m_s3, centripetal_jerk + half_jerk));
  const double a =
      std::max(peak.acceleration * length,
               std::min(leg(limits.acceleration_m_s2, v * angular_rate), across / (3.0 * angular_rate)));
  const double j =
      std::max(peak.jerk * length, leg(limits.jerk_m_s3, 3.0 * a * angular_rate) - centripetal_jerk);
  return governed_path(limits, arc.law, length, rotation_rad(arc.tool), a, j);
}

void add_law(GovernedMotion& motion, const GovernedLaw& law) noexcept {
  // A law that moves nothing restricts nothing.
  if (law.law.jerk(0) != 0.0) motion.laws[motion.count++] = law;
}

}  // namespace

void take_frames(const Command& command, Kinematics& arm) noexcept {
  const auto take = [&arm](const Frames& frames) { arm.set_frames(frames.base_T_0, frames.n_T_tool); };
  if (command.kind == MotionKind::kLine) take(command.line.frames);
  if (command.kind == MotionKind::kArc) take(command.arc.frames);
}

SetPoint evaluate_command(const ArmModel& arm, const Command& command, const SetPoint& base, double time_s,
                          PathKnots knots) noexcept {
  SetPoint set_point = base;
  switch (command.kind) {
    case MotionKind::kJoint:
      for (std::size_t i = 0; i < std::min<std::size_t>(arm.dof, kMaxJoints); ++i) {
        set_point.position_q[i] += evaluate(command.joint.law[i], time_s).position;
      }
      break;
    case MotionKind::kLine:
      evaluate_path(arm, command.line, time_s, knots, set_point);
      break;
    case MotionKind::kArc:
      evaluate_path(arm, command.arc, time_s, knots, set_point);
      break;
    case MotionKind::kGripper:
      set_point.opening += evaluate(command.gripper.law, time_s).position;
      break;
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
    case MotionKind::kLine:
      add_law(motion, governed_line(arm.path, command.line));
      break;
    case MotionKind::kArc:
      add_law(motion, governed_arc(arm.path, command.arc));
      break;
    case MotionKind::kGripper: {
      const LawPeaks peak = peaks(command.gripper.law);
      add_law(motion, {LawSegments(command.gripper.law), peak.acceleration, peak.jerk});
      break;
    }
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
