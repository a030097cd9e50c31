// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <type_traits>

#include "corbot/kinematics/closed_form.h"
#include "corbot/kinematics/joints.h"
#include "corbot/motion/frames.h"
#include "corbot/motion/time_law.h"

namespace corbot {

/// The kind of a command to the real-time task. Every kind begins and ends at rest.
enum class MotionKind : std::uint32_t { kJoint = 1, kLine = 2, kArc = 3, kDwell = 4, kGripper = 5 };

/// Joint-space motion: every joint has a law of its own, all of the same duration.
struct JointMotion {
  std::array<TimeLaw, kMaxJoints> law;  ///< distance in rad or m; joints beyond the arm's are all zero
  Frames frames;                        ///< the frames of the check against the workspace
};

/// The tool's turn along a line or an arc, in step with the path parameter s. For an arm that follows every
/// orientation (Follows::kFull) it is exp(s · turn) · from, base frame: about one axis, at one rate. Any
/// other arm follows angles of its own (FollowedAngles), which are interpolated. Fields that an arm does not
/// use are 1 and zeros.
struct OrientationPath {
  Quaternion from;   ///< of base_T_tool at s = 0, unit length
  Vector3 turn_rad;  ///< rotation vector, at most π long
  Angles from_angles_rad;
  Angles to_angles_rad;
};

/// The place of the knots and the pieces of a path's rate in the servant's segment.
struct KnotRange {
  std::uint16_t slot;
  std::uint16_t count;   ///< number of knots, motion/rate_knots.h
  std::uint16_t pieces;  ///< number of pieces, motion/rate_pieces.h
};

/// Straight line of the TCP, base frame (of `frames`). The path parameter runs from 0 to 1.
struct LineMotion {
  std::array<double, 3> from_m;
  std::array<double, 3> to_m;
  OrientationPath tool;
  std::uint32_t solution;  ///< number of the arm's solution, the same along the whole path
  KnotRange knots;
  Frames frames;  ///< the frames of planning and of execution
};

/// Circular arc of the TCP, base frame (of `frames`): centre + radius·(cos(ψ) u + sin(ψ) v), ψ = parameter ·
/// angle.
struct ArcMotion {
  std::array<double, 3> centre_m;
  std::array<double, 3> u;  ///< unit vector from the centre to the start
  std::array<double, 3> v;  ///< unit vector in the plane, perpendicular to u, in the sense of travel
  double radius_m;
  double angle_rad;  ///< > 0, at most 2π
  OrientationPath tool;
  std::uint32_t solution;  ///< number of the arm's solution, the same along the whole path
  KnotRange knots;
  Frames frames;  ///< the frames of planning and of execution
};

/// Standstill for a time.
struct DwellMotion {
  double duration_s;
};

/// Gripper opening (0 closed … 1 open) along a law of unit distance or less.
struct GripperMotion {
  double from;
  TimeLaw law;
};

/// One accepted motion in the command ring. Fixed size; the real-time task checks every field.
struct Command {
  std::uint64_t id;     ///< numbered from 1, rising
  std::uint64_t epoch;  ///< StopSegment::count when it was planned; an older value is refused
  MotionKind kind;
  /// The number of the real-time task that it was planned for, the low 32 bits: no other task carries it out.
  std::uint32_t incarnation;
  /// number_of() the further shapes of the workspace that it was planned with, fingerprint.h; 0: none.
  std::uint64_t shapes;
  double duration_s;  ///< at override 100 %
  Joints start_q;     ///< must equal the set-point at which the arm rests when the command begins
  Joints end_q;       ///< the arm's rest position afterwards
  union {
    JointMotion joint;
    LineMotion line;
    ArcMotion arc;
    DwellMotion dwell;
    GripperMotion gripper;
  };
};
static_assert(std::is_trivially_copyable_v<Command> && std::is_standard_layout_v<Command>);
static_assert(sizeof(Command) <= 512);

/// Returns null if the command has no path.
[[nodiscard]] constexpr const KnotRange* knots_of(const Command& command) noexcept {
  if (command.kind == MotionKind::kLine) return &command.line.knots;
  return command.kind == MotionKind::kArc ? &command.arc.knots : nullptr;
}
[[nodiscard]] constexpr KnotRange* knots_of(Command& command) noexcept {
  if (command.kind == MotionKind::kLine) return &command.line.knots;
  return command.kind == MotionKind::kArc ? &command.arc.knots : nullptr;
}

}  // namespace corbot
