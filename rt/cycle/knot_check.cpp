// SPDX-License-Identifier: Apache-2.0
#include "rt/cycle/knot_check.h"

#include <algorithm>
#include <cmath>

#include "corbot/motion/path.h"
#include "rt/cycle/set_point_check.h"

namespace corbot::rt {
namespace {

constexpr double kRateTolerance = 1e-6;  // m and rad a unit of s
constexpr CommandVerdict kKnotsGood{};

CommandVerdict malformed_knot(double value, std::size_t joint = kMaxJoints) noexcept {
  return {Verdict::kMalformed, joint < kMaxJoints ? static_cast<std::int32_t>(joint) : -1, value};
}

/// The tool at these joints against the path at s.
template <class Path>
CommandVerdict check_point(const ArmModel& arm, const Path& path, const Joints& q, double s) noexcept {
  if (!is_in_range(arm, q, kGateTolerance_q)) return {Verdict::kLimit, -1, s};
  const Pose there = arm.kinematics.forward(q);
  const PathPoint wanted = point_at(path, s);
  const double off_m = norm(there.position_m - wanted.position_m);
  if (!(off_m <= KnotCheck::kTracking)) return malformed_knot(off_m);
  double off_rad = 0.0;
  if (arm.kinematics.follows() == Follows::kFull)
    off_rad = angle_between(there.orientation, wanted.orientation);
  const FollowedAngles followed = arm.kinematics.followed();
  const Angles angles_rad = followed.at(q);
  for (std::size_t k = 0; k < followed.count; ++k)
    off_rad = std::max(off_rad, std::abs(angles_rad[k] - wanted.angles_rad[k]));
  return off_rad <= KnotCheck::kTracking ? kKnotsGood : malformed_knot(off_rad);
}

/// The tool's velocity at a knot against the path's.
template <class Path>
CommandVerdict check_rate(const ArmModel& arm, const Path& path, const PathKnot& knot) noexcept {
  Jacobian jacobian = arm.kinematics.jacobian(knot.q);
  const Vector3 v = velocity_at(path, knot.s), turn = turn_of(path.tool);
  const FollowedAngles followed = arm.kinematics.followed();
  for (std::size_t k = 0; k < followed.count; ++k) jacobian[3 + k] = followed.rows[k];
  const std::size_t rows = arm.kinematics.follows() == Follows::kFull ? 6 : 3 + followed.count;
  for (std::size_t k = 0; k < rows; ++k) {
    double off = k < 3 ? -v[k] : -turn[k - 3];
    for (std::size_t i = 0; i < std::min<std::size_t>(arm.dof, kMaxJoints); ++i)
      off += jacobian[k][i] * knot.rate_q[i];
    if (!(std::abs(off) <= kRateTolerance)) return malformed_knot(off);
  }
  return kKnotsGood;
}

template <class Path>
CommandVerdict check_knot(const ArmModel& arm, const Path& path, const PathKnot& knot) noexcept {
  for (std::size_t i = arm.dof; i < kMaxJoints; ++i) {
    if (knot.q[i] != 0.0 || knot.rate_q[i] != 0.0 || knot.bend_q[i] != 0.0)
      return malformed_knot(knot.q[i], i);
  }
  const CommandVerdict place = check_point(arm, path, knot.q, knot.s);
  return place.ok() ? check_rate(arm, path, knot) : place;
}

/// From its first knot, which has passed, to its last.
template <class Path>
CommandVerdict check_piece(const ArmModel& arm, const Path& path, const PathKnot& a,
                           const PathKnot& b) noexcept {
  if (!(b.s > a.s && b.s <= 1.0)) return malformed_knot(b.s);
  for (std::size_t i = 0; i < kMaxJoints; ++i) {
    const double step_q = b.q[i] - a.q[i];
    if (!(std::abs(step_q) <= kLongestPiece_q)) return malformed_knot(step_q, i);
  }
  const CommandVerdict end = check_knot(arm, path, b);
  if (!end.ok()) return end;
  const KnotPiece piece(a, b);
  for (const double t : {0.25, 0.75}) {
    const CommandVerdict between = check_point(arm, path, piece.at(t), a.s + t * piece.length_s());
    if (!between.ok()) return between;
  }
  return kKnotsGood;
}

/// The command begins at the first knot, and ends where its law does.
CommandVerdict check_ends(const Command& command, const TimeLaw& law, PathKnots knots) noexcept {
  if (knots.size() < 2 || knots.front().s != 0.0 || knots.back().s != 1.0)
    return malformed_knot(static_cast<double>(knots.size()));
  const Joints end_q = joints_at(knots, law.distance);
  for (std::size_t i = 0; i < kMaxJoints; ++i) {
    const double first_q = knots.front().q[i] - command.start_q[i];
    if (!(std::abs(first_q) <= kStartTolerance))
      return {Verdict::kDiscontinuous, static_cast<std::int32_t>(i), first_q};
    const double last_q = end_q[i] - command.end_q[i];
    if (!(std::abs(last_q) <= kStartTolerance)) return malformed_knot(last_q, i);
  }
  return kKnotsGood;
}

template <class Path>
std::optional<CommandVerdict> check_some(const ArmModel& arm, const Command& command, const Path& path,
                                         PathKnots knots, std::size_t& next) noexcept {
  if (next == 0) {
    const CommandVerdict ends = check_ends(command, path.law, knots);
    if (!ends.ok()) return ends;
    const CommandVerdict first = check_knot(arm, path, knots.front());
    if (!first.ok()) return first;
  }
  for (std::size_t n = 0; n < KnotCheck::kPieces && next + 1 < knots.size(); ++n, ++next) {
    const CommandVerdict piece = check_piece(arm, path, knots[next], knots[next + 1]);
    if (!piece.ok()) return piece;
  }
  if (next + 1 < knots.size()) return std::nullopt;
  return kKnotsGood;
}

}  // namespace

std::optional<CommandVerdict> KnotCheck::step(const ArmModel& arm, const Command& command,
                                              PathKnots knots) noexcept {
  if (command.id != id_) next_ = 0;
  id_ = command.id;
  return command.kind == MotionKind::kArc ? check_some(arm, command, command.arc, knots, next_)
                                          : check_some(arm, command, command.line, knots, next_);
}

}  // namespace corbot::rt
