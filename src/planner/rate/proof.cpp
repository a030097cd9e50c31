// SPDX-License-Identifier: Apache-2.0
#include "planner/rate/proof.h"

#include <algorithm>
#include <cmath>

namespace corbot::rate {
namespace {

void scale(Limits& limits, const PlanSettings& settings, std::size_t dof) noexcept {
  for (std::size_t i = 0; i < dof; ++i) limits.speed[i] *= settings.joint_speed_ratio[i];
  limits.speed[kPath] *= settings.speed_ratio;
}

}  // namespace

Limits limits_of(const ArmModel& model, const PlanSettings& settings, const LineMotion& line) noexcept {
  Limits limits = limits_of(model, line);
  scale(limits, settings, model.dof);
  return limits;
}

Limits limits_of(const ArmModel& model, const PlanSettings& settings, const ArcMotion& arc) noexcept {
  Limits limits = limits_of(model, arc);
  scale(limits, settings, model.dof);
  return limits;
}

Proof prove(const RateLaw& law, std::span<const Knot> knots, const Limits& limits) {
  Proof proof;
  proof.pieces.resize(law.pieces().size());
  ProofWalk walk(law.view(), knots, limits, proof.pieces);
  ProofWalk::Result result{};
  do result = walk.step();
  while (result == ProofWalk::Result::kMore);
  proof.is_forward = result == ProofWalk::Result::kDone;
  for (const Shares& shares : proof.pieces)
    proof.factor =
        std::max({proof.factor, shares.speed, std::sqrt(shares.acceleration), std::cbrt(shares.jerk)});
  return proof;
}

}  // namespace corbot::rate
