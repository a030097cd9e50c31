// SPDX-License-Identifier: Apache-2.0
#include "planner/numeric/tracking.h"

#include <algorithm>
#include <cmath>

namespace corbot::numeric {
namespace {

constexpr double kBetweenSamples = 0.3 * kTracking;  // what is left to the error between two samples
constexpr double kMostSamples = 20'000.0;            // of one piece

}  // namespace

Tracking::Tracking(const ArmModel& model, const PathFunction& path)
    : model_(model),
      path_(path),
      count_(model.kinematics.joint_count()),
      is_full_(model.kinematics.follows() == Follows::kFull),
      followed_(model.kinematics.followed()) {
  // From the tool inwards, over the feet of the perpendiculars: each is fixed in the links on both sides of its axis.
  const JointChain& chain = model.kinematics.chain();
  Vector3 last_m = (chain.zero_T_n * chain.n_T_tool).position_m;
  double length_m = 0.0;
  for (std::size_t i = count_; i-- > 0;) {
    const JointAxis& axis = chain.axes[i];
    if (axis.kind == JointKind::kPrismatic) {
      length_m += std::max(std::abs(model.joints[i].lower_q), std::abs(model.joints[i].upper_q));
      lever_[i] = 1.0;
      continue;
    }
    const Vector3 foot_m = axis.point_m + dot(last_m - axis.point_m, axis.direction) * axis.direction;
    length_m += norm(last_m - foot_m);
    last_m = foot_m;
    lever_[i] = length_m;
  }
}

Tracking::Error Tracking::error(const KnotPiece& piece, double t) const noexcept {
  const Joints q = piece.at(t);
  const Pose there = model_.kinematics.forward(q);
  const PathPoint wanted = path_.point(piece.begin_s() + t * piece.length_s());
  Error error{norm(there.position_m - wanted.position_m), 0.0};
  if (is_full_) {
    const Quaternion d = conjugate(wanted.orientation) * there.orientation;
    error.half_sine = std::sqrt(d.x * d.x + d.y * d.y + d.z * d.z);
  }
  const Angles angles_rad = followed_.at(q);
  for (std::size_t k = 0; k < followed_.count; ++k)
    error.half_sine = std::max(error.half_sine, 0.5 * std::abs(angles_rad[k] - wanted.angles_rad[k]));
  return error;
}

double Tracking::sampled(const KnotPiece& piece) const noexcept {
  double greatest = 0.0;
  for (const double t : {0.25, 0.5, 0.75}) {
    const Error e = error(piece, t);
    greatest = std::max({greatest, e.position_m, 2.0 * e.half_sine});
  }
  return greatest;
}

/// p″ = Σ Jn qn″ + ΣΣ (∂Jn/∂qm) qn′ qm′, the second sum's vectors no longer than that of the joint further out, and 0 where the one
/// further in slides (path_form.h).
double Tracking::bend_of_position(const PieceBounds& bounds) const noexcept {
  double bend = path_.bend_m();
  for (std::size_t n = 0; n < count_; ++n) {
    bend += lever_[n] * bounds.bend_q[n];
    for (std::size_t m = 0; m < count_; ++m) {
      if (model_.kinematics.joint_kind(std::min(n, m)) == JointKind::kPrismatic) continue;
      bend += lever_[std::max(n, m)] * bounds.rate_q[n] * bounds.rate_q[m];
    }
  }
  return bend;
}

/// Of an orientation, with q = conj(qp) qf: q′ = ½ conj(qp) (ωf − ωp) qf, so |q″| ≤ ½ |αf| + ¼ |ωf − ωp| (|ωf| + |ωp|), ωp being constant.
double Tracking::bend_of_half_sine(const PieceBounds& bounds) const noexcept {
  if (!is_full_) {
    double bend = 0.0;
    for (std::size_t k = 0; k < followed_.count; ++k) {
      double angle = 0.0;
      for (std::size_t n = 0; n < count_; ++n) angle += std::abs(followed_.rows[k][n]) * bounds.bend_q[n];
      bend = std::max(bend, 0.5 * angle);
    }
    return bend;
  }
  double turning = 0.0, angular = 0.0;  // |ωf|, |αf|
  for (std::size_t n = 0; n < count_; ++n) {
    if (model_.kinematics.joint_kind(n) == JointKind::kPrismatic) continue;
    angular += bounds.bend_q[n] + turning * bounds.rate_q[n];
    turning += bounds.rate_q[n];
  }
  const double sum = turning + norm(path_.turn_rad());
  return 0.5 * angular + 0.25 * sum * sum;
}

bool Tracking::proves(const KnotPiece& piece) const noexcept {
  const PieceBounds bounds = bound_piece(piece, 0.0, 1.0);
  const double bend = std::max(bend_of_position(bounds), 2.0 * bend_of_half_sine(bounds));
  const double samples = std::ceil(piece.length_s() * std::sqrt(bend / (8.0 * kBetweenSamples)));
  if (!(samples <= kMostSamples)) return false;
  const int count = std::max(1, static_cast<int>(samples));
  for (int k = 0; k <= count; ++k) {
    const Error e = error(piece, static_cast<double>(k) / count);
    // A half sine of 1e-6 is half the angle but for a part of 1e-12.
    if (!(std::max(e.position_m, 2.0 * e.half_sine) <= kTracking - kBetweenSamples)) return false;
  }
  return true;
}

}  // namespace corbot::numeric
