// SPDX-License-Identifier: Apache-2.0
#include "rt/cycle/rate_check.h"

#include <algorithm>
#include <cmath>
#include <span>
#include <utility>

#include "corbot/motion/path.h"
#include "corbot/motion/path_joints.h"
#include "rt/cycle/set_point_check.h"

namespace corbot::rt {
namespace {

constexpr CommandVerdict kKnotsGood{};

CommandVerdict malformed_knot(double value, std::size_t joint = kMaxJoints) noexcept {
  return {Verdict::kMalformed, joint < kMaxJoints ? static_cast<std::int32_t>(joint) : -1, value};
}

/// Compares the tool at these joints with the path at s.
template <class Path>
CommandVerdict check_point(const ArmModel& arm, const Path& path, const Joints& q, double s) noexcept {
  if (!is_in_range(arm, q, kGateTolerance_q)) return {Verdict::kLimit, -1, s};
  const double off = tool_deviation(arm.kinematics, q, point_at(path, s));
  return off <= RateCheck::kTracking ? kKnotsGood : malformed_knot(off);
}

/// Compares the tool's velocity, if s has the rate `s_rate`, with the path's.
template <class Path>
CommandVerdict check_rate(const ArmModel& arm, const Path& path, const Joints& q, const Joints& rate_q,
                          double s, double s_rate, double tolerance) noexcept {
  Jacobian jacobian = arm.kinematics.jacobian(q);
  const Vector3 v = velocity_at(path, s), turn = turn_of(path.tool);
  const FollowedAngles followed = arm.kinematics.followed();
  for (std::size_t k = 0; k < followed.count; ++k) jacobian[3 + k] = followed.rows[k];
  const std::size_t rows = arm.kinematics.follows() == Follows::kFull ? 6 : 3 + followed.count;
  for (std::size_t k = 0; k < rows; ++k) {
    double off = -s_rate * (k < 3 ? v[k] : turn[k - 3]);
    for (std::size_t i = 0; i < std::min<std::size_t>(arm.dof, kMaxJoints); ++i)
      off += jacobian[k][i] * rate_q[i];
    if (!(std::abs(off) <= tolerance)) return malformed_knot(off);
  }
  return kKnotsGood;
}

Joints joints_of(const rate::State& z) noexcept {
  Joints q{};
  std::copy_n(z.begin(), q.size(), q.begin());
  return q;
}

template <class Path>
CommandVerdict check_rate_knot(const ArmModel& arm, const Path& path, const rate::Knot& knot) noexcept {
  constexpr double kRate = 1e-5;  // m and rad per unit of lambda
  for (std::size_t i = arm.dof; i < kMaxJoints; ++i) {
    if (knot.z[i] != 0.0 || knot.rate[i] != 0.0 || knot.bend[i] != 0.0) return malformed_knot(knot.z[i], i);
  }
  const Joints q = joints_of(knot.z);
  const double s = knot.z[rate::kPath];
  const CommandVerdict place = check_point(arm, path, q, s);
  return place.ok() ? check_rate(arm, path, q, joints_of(knot.rate), s, knot.rate[rate::kPath], kRate)
                    : place;
}

/// Checks a cell from its first knot, which has passed, to its last.
template <class Path>
CommandVerdict check_cell(const ArmModel& arm, const Path& path, const rate::Knot& a,
                          const rate::Knot& b) noexcept {
  if (!(b.lambda_s > a.lambda_s)) return malformed_knot(b.lambda_s);
  if (!(b.z[rate::kPath] > a.z[rate::kPath])) return malformed_knot(b.z[rate::kPath]);
  for (std::size_t i = 0; i < kMaxJoints; ++i) {
    const double step_q = b.z[i] - a.z[i];
    if (!(std::abs(step_q) <= kLongestStep_q)) return malformed_knot(step_q, i);
  }
  const CommandVerdict end = check_rate_knot(arm, path, b);
  if (!end.ok()) return end;
  const rate::Cell cell(a, b);
  for (const double t : {0.25, 0.75}) {
    const rate::State z = cell.at(t);
    const CommandVerdict between = check_point(arm, path, joints_of(z), z[rate::kPath]);
    if (!between.ok()) return between;
  }
  return kKnotsGood;
}

/// Checks the path's beginning and end.
CommandVerdict check_rate_ends(const Command& command, std::span<const rate::Knot> knots) noexcept {
  constexpr double kSame_q = 1e-12;  // any more would be a jerk
  const rate::Knot &first = knots.front(), &last = knots.back();
  if (first.lambda_s != 0.0 || first.z[rate::kPath] != 0.0) return malformed_knot(first.lambda_s);
  if (last.z[rate::kPath] != 1.0) return malformed_knot(last.z[rate::kPath]);
  for (std::size_t i = 0; i < kMaxJoints; ++i) {
    const double first_q = first.z[i] - command.start_q[i], last_q = last.z[i] - command.end_q[i];
    if (!(std::abs(first_q) <= kSame_q))
      return {Verdict::kDiscontinuous, static_cast<std::int32_t>(i), first_q};
    if (!(std::abs(last_q) <= kSame_q)) return malformed_knot(last_q, i);
  }
  return kKnotsGood;
}

/// Checks the beginning of a path in time.
CommandVerdict check_first_piece(const rate::Piece& first) noexcept {
  if (first.begin_s != 0.0 || first.begin.lambda_s != 0.0 || first.begin.v != 0.0 || first.begin.a != 0.0)
    return malformed_knot(first.begin_s);
  return kKnotsGood;
}

}  // namespace

template <class Motion>
std::optional<CommandVerdict> RateCheck::check_some(const ArmModel& arm, const Command& command,
                                                    const Motion& motion,
                                                    const rate::RatePath& path) noexcept {
  if (command.id != id_) {
    id_ = command.id;
    piece_ = cell_ = 0;
    last_ = {};
    is_proved_ = false;
    limits_ = rate::limits_of(arm, motion);
    walk_ = rate::ProofWalk(path.law, path.knots, limits_, shares_);
    for (const CommandVerdict& verdict :
         {check_rate_ends(command, path.knots), check_first_piece(path.law.pieces.front()),
          check_rate_knot(arm, motion, path.knots.front())}) {
      if (!verdict.ok()) return verdict;
    }
    return std::nullopt;
  }
  if (piece_ < path.law.pieces.size()) {
    const CommandVerdict pieces = check_pieces(path.law);
    return pieces.ok() ? std::nullopt : std::optional(pieces);
  }
  const bool looked = cell_ + 1 < path.knots.size();
  for (std::size_t n = 0; n < kCells && cell_ + 1 < path.knots.size(); ++n, ++cell_) {
    const CommandVerdict cell = check_cell(arm, motion, path.knots[cell_], path.knots[cell_ + 1]);
    if (!cell.ok()) return cell;
  }
  if (looked) return std::nullopt;
  if (!is_proved_) return prove_some(path.law.pieces.size());
  return curve_.step(kCurveSteps) ? std::optional(kKnotsGood) : std::nullopt;
}

/// Checks that the pieces go from rest to rest without a jump. Rounding leaves far less than a jerk that
/// DifferenceCheck would detect.
CommandVerdict RateCheck::check_pieces(const rate::RatePieces& law) noexcept {
  constexpr double kPlace = 1e-12, kSpeed = 1e-9, kAcceleration_1_s = 1e-6;
  const double place_s = kPlace * std::max(1.0, law.length_s);
  for (std::size_t n = 0; n < kPieces && piece_ < law.pieces.size(); ++n, ++piece_) {
    const double begin_s = law.pieces[piece_].begin_s;
    const bool is_last = piece_ + 1 == law.pieces.size();
    const double end_s = is_last ? law.duration_s : law.pieces[piece_ + 1].begin_s;
    if (!(end_s > begin_s)) return malformed_knot(end_s);
    const rate::RateState here = law.at(piece_, begin_s);
    if (!(std::abs(here.lambda_s - last_.lambda_s) <= place_s)) return malformed_knot(here.lambda_s);
    if (!(std::abs(here.v - last_.v) <= kSpeed)) return malformed_knot(here.v);
    if (!(std::abs(here.a - last_.a) <= kAcceleration_1_s)) return malformed_knot(here.a);
    last_ = law.at(piece_, end_s);
  }
  return kKnotsGood;
}

std::optional<CommandVerdict> RateCheck::prove_some(std::size_t pieces) noexcept {
  constexpr double kRounding = 1.0 + 1e-6;
  rate::ProofWalk::Result result{};
  for (std::size_t n = 0; n < kStretches && result == rate::ProofWalk::Result::kMore; ++n)
    result = walk_.step();
  if (result == rate::ProofWalk::Result::kMore) return std::nullopt;
  if (result == rate::ProofWalk::Result::kRefused) return malformed_knot(0.0);
  rate::Shares most{};
  for (std::size_t k = 0; k < pieces; ++k) most = rate::greater(most, shares_[k]);
  for (const auto& [share, bound] : {std::pair{most.speed, 1.0},
                                     {most.acceleration, 1.0 - rate::kAccelerationReserve},
                                     {most.jerk, 1.0 - rate::kJerkReserve}}) {
    if (!(share <= bound * kRounding)) return CommandVerdict{Verdict::kLimit, -1, share};
  }
  is_proved_ = true;
  curve_ = rate::CurveSteps(rate::RateLimits(limits_).view(), rate::RateCurve::everywhere(most));
  return std::nullopt;
}

std::optional<CommandVerdict> RateCheck::step(const ArmModel& arm, const Command& command,
                                              const rate::RatePath& path) noexcept {
  return command.kind == MotionKind::kArc ? check_some(arm, command, command.arc, path)
                                          : check_some(arm, command, command.line, path);
}

}  // namespace corbot::rt
