// SPDX-License-Identifier: Apache-2.0
#include "rt/cycle/command_check.h"

#include <algorithm>
#include <cmath>
#include <initializer_list>
#include <numbers>
#include <utility>

#include "corbot/channel/layout.h"
#include "corbot/motion/law_evaluation.h"
#include "rt/cycle/set_point_check.h"

namespace corbot::rt {
namespace {

constexpr double kLawTolerance = 1e-6;
constexpr double kDurationTolerance = 1e-9;
constexpr double kFrameTolerance = 1e-9;
constexpr double kLargestRadius_m = 1e6;
constexpr double kLargestAngle_rad = 16.0 * std::numbers::pi;  // sums of joints that turn more than once

constexpr CommandVerdict kGood{};

CommandVerdict malformed(double value, std::int32_t joint = -1) noexcept {
  return {Verdict::kMalformed, joint, value};
}
CommandVerdict limit(double value, std::int32_t joint = -1) noexcept {
  return {Verdict::kLimit, joint, value};
}
CommandVerdict discontinuous(double value, std::int32_t joint = -1) noexcept {
  return {Verdict::kDiscontinuous, joint, value};
}

bool within(double value, double bound) noexcept { return value <= bound * (1.0 + kLawTolerance); }

bool is_small(const std::array<double, 3>& vector, double bound) noexcept {
  return std::all_of(vector.begin(), vector.end(), [bound](double x) { return std::abs(x) <= bound; });
}

double dot(const std::array<double, 3>& a, const std::array<double, 3>& b) noexcept {
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

/// Checks that a law is well formed, not longer than the command, and of exactly its duration if it moves.
CommandVerdict check_law(const TimeLaw& law, double duration_s, std::int32_t joint) noexcept {
  if (!is_well_formed(law)) return malformed(law.distance, joint);
  const double tolerance_s = kDurationTolerance * std::max(1.0, duration_s);
  const double difference_s = law.duration_s() - duration_s;
  if (difference_s > tolerance_s) return malformed(law.duration_s(), joint);
  if (law.distance != 0.0 && difference_s < -tolerance_s) return malformed(law.duration_s(), joint);
  return kGood;
}

/// Returns the first invalid number of a frame.
double fault_of(const Pose& frame, double farthest_m) noexcept {
  for (const double x : frame.position_m) {
    if (!(std::abs(x) <= farthest_m)) return x;
  }
  return squared_norm(frame.orientation) - 1.0;
}

CommandVerdict check_frames(const Frames& frames) noexcept {
  const auto& [base_T_0, n_T_tool] = frames;
  if (!is_frame(base_T_0, kFarthestBase_m)) return malformed(fault_of(base_T_0, kFarthestBase_m));
  if (!is_frame(n_T_tool, kFarthestTool_m)) return malformed(fault_of(n_T_tool, kFarthestTool_m));
  return kGood;
}

CommandVerdict check_joint_motion(const ArmModel& arm, const Command& command) noexcept {
  for (std::size_t i = 0; i < kMaxJoints; ++i) {
    const auto joint = static_cast<std::int32_t>(i);
    const TimeLaw& law = command.joint.law[i];
    const CommandVerdict verdict = check_law(law, command.duration_s, joint);
    if (!verdict.ok()) return verdict;
    if (i >= arm.dof) {
      if (law.distance != 0.0) return malformed(law.distance, joint);
      continue;
    }
    const JointLimits& limits = arm.joints[i];
    const LawPeaks peak = peaks(law);
    if (!within(peak.velocity, limits.speed_q_s)) return limit(peak.velocity, joint);
    if (!within(peak.acceleration, limits.acceleration_q_s2)) return limit(peak.acceleration, joint);
    if (!within(peak.jerk, limits.jerk_q_s3)) return limit(peak.jerk, joint);
    const double miss_q = command.start_q[i] + law.distance - command.end_q[i];
    if (!(std::abs(miss_q) <= kStartTolerance)) return malformed(miss_q, joint);
  }
  return check_frames(command.joint.frames);
}

/// Checks that exactly the values that the arm follows are given, and are finite.
CommandVerdict check_orientation(const Kinematics& arm, const OrientationPath& tool) noexcept {
  const bool is_full = arm.follows() == Follows::kFull;
  const double excess = squared_norm(tool.from) - 1.0;
  if (!(std::abs(excess) <= kFrameTolerance)) return malformed(excess);
  const double turn_rad = norm(tool.turn_rad);
  if (!(turn_rad <= (is_full ? std::numbers::pi * (1.0 + kFrameTolerance) : 0.0))) return malformed(turn_rad);
  const std::size_t followed = is_full ? 0 : arm.followed().count;
  for (std::size_t k = 0; k < tool.from_angles_rad.size(); ++k) {
    const double bound = k < followed ? kLargestAngle_rad : 0.0;
    for (const double angle : {tool.from_angles_rad[k], tool.to_angles_rad[k]}) {
      if (!(std::abs(angle) <= bound)) return malformed(angle);
    }
  }
  return kGood;
}

/// Checks the common fields of lines and arcs, except their rate: RateCheck.
template <class Path>
CommandVerdict check_path(const ArmModel& arm, const Path& path) noexcept {
  const CommandVerdict frames = check_frames(path.frames);
  if (!frames.ok()) return frames;
  if (arm.kinematics.has_closed_form() ? !arm.kinematics.has_solution(path.solution) : path.solution != 0)
    return malformed(static_cast<double>(path.solution));
  const KnotRange& range = path.knots;
  if (!(range.count >= 2 && range.count <= kMostKnots)) return malformed(range.count);
  if (!(range.pieces >= 1 && range.pieces <= rate::kMostPieces)) return malformed(range.pieces);
  if (!(range.slot < kKnotSlots)) return malformed(range.slot);
  return check_orientation(arm.kinematics, path.tool);
}

CommandVerdict check_line(const ArmModel& arm, const LineMotion& line) noexcept {
  if (!is_small(line.from_m, kFarthestCoordinate_m)) return malformed(line.from_m[0]);
  if (!is_small(line.to_m, kFarthestCoordinate_m)) return malformed(line.to_m[0]);
  return check_path(arm, line);
}

CommandVerdict check_arc(const ArmModel& arm, const ArcMotion& arc) noexcept {
  if (!is_small(arc.centre_m, kLargestRadius_m)) return malformed(arc.centre_m[0]);
  if (!(arc.radius_m > 0.0 && arc.radius_m <= kLargestRadius_m)) return malformed(arc.radius_m);
  if (!(arc.angle_rad > 0.0 && arc.angle_rad <= 2.0 * std::numbers::pi * (1.0 + kFrameTolerance))) {
    return malformed(arc.angle_rad);
  }
  for (const double error : {dot(arc.u, arc.u) - 1.0, dot(arc.v, arc.v) - 1.0, dot(arc.u, arc.v)}) {
    if (!(std::abs(error) <= kFrameTolerance)) return malformed(error);
  }
  return check_path(arm, arc);
}

CommandVerdict check_stays(const Command& command) noexcept {
  for (std::size_t i = 0; i < kMaxJoints; ++i) {
    const double miss_q = command.end_q[i] - command.start_q[i];
    if (!(std::abs(miss_q) <= kStartTolerance)) return malformed(miss_q, static_cast<std::int32_t>(i));
  }
  return kGood;
}

CommandVerdict check_dwell(const Command& command) noexcept {
  const double duration_s = command.dwell.duration_s;
  if (!(duration_s >= 0.0 && duration_s <= kLongestPlan_s)) return malformed(duration_s);
  if (!(std::abs(duration_s - command.duration_s) <= kDurationTolerance * std::max(1.0, duration_s))) {
    return malformed(command.duration_s);
  }
  return check_stays(command);
}

CommandVerdict check_gripper(const ArmModel& arm, const Command& command, double opening) noexcept {
  const GripperMotion& gripper = command.gripper;
  if (!(gripper.from >= 0.0 && gripper.from <= 1.0)) return malformed(gripper.from);
  const CommandVerdict verdict = check_law(gripper.law, command.duration_s, -1);
  if (!verdict.ok()) return verdict;
  const double to = gripper.from + gripper.law.distance;
  if (!(to >= -kDurationTolerance && to <= 1.0 + kDurationTolerance)) return malformed(to);
  if (!(std::abs(gripper.from - opening) <= kStartTolerance)) return discontinuous(gripper.from);
  // The servo at full speed needs travel_s for the whole way. No law's peak may be faster than twice that
  // speed: a law without a cruise has a peak of twice its mean.
  const double fastest = 2.0 / arm.gripper.travel_s;
  const double velocity = peaks(gripper.law).velocity;
  if (!within(velocity, fastest)) return limit(velocity);
  return check_stays(command);
}

CommandVerdict check_start(const Command& command, const Joints& rest_q) noexcept {
  for (std::size_t i = 0; i < kMaxJoints; ++i) {
    const auto joint = static_cast<std::int32_t>(i);
    if (!std::isfinite(command.start_q[i])) return malformed(command.start_q[i], joint);
    const double miss_q = command.start_q[i] - rest_q[i];
    if (!(std::abs(miss_q) <= kStartTolerance)) return discontinuous(miss_q, joint);
  }
  return kGood;
}

}  // namespace

CommandVerdict check_command(const ArmModel& arm, const Command& command, const RestState& rest) noexcept {
  if (command.id <= rest.last_id || command.id - rest.last_id > kLargestIdStep) {
    return malformed(static_cast<double>(command.id));
  }
  if (!(command.duration_s >= 0.0 && command.duration_s <= kLongestCommand_s))
    return malformed(command.duration_s);
  for (std::size_t i = 0; i < kMaxJoints; ++i) {
    if (!std::isfinite(command.end_q[i])) return malformed(command.end_q[i], static_cast<std::int32_t>(i));
  }
  const CommandVerdict start = check_start(command, rest.position_q);
  if (!start.ok()) return start;
  if (!is_in_range(arm, command.end_q, kGateTolerance_q)) return limit(command.end_q[0]);
  switch (command.kind) {
    case MotionKind::kJoint:
      return check_joint_motion(arm, command);
    case MotionKind::kLine:
      return check_line(arm, command.line);
    case MotionKind::kArc:
      return check_arc(arm, command.arc);
    case MotionKind::kDwell:
      return check_dwell(command);
    case MotionKind::kGripper:
      return check_gripper(arm, command, rest.opening);
  }
  return malformed(static_cast<double>(command.kind));
}

}  // namespace corbot::rt
