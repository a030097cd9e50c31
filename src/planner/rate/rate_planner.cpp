// SPDX-License-Identifier: Apache-2.0
#include "planner/rate/rate_planner.h"

#include <algorithm>
#include <numeric>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "corbot/motion/path.h"
#include "planner/rate/grid.h"
#include "planner/rate/optimum.h"

namespace corbot::rate {
namespace {

constexpr double kNoTravel = 1e-30;  // metres and radians
constexpr double kHardly = 1e-10;    // metres and radians: largest distance of an end
constexpr double kGap = 2e-3;        // largest error of the result, as a part of the time
constexpr double kFirstGap = 1e-2;   // the first round only finds where the limits are exceeded
constexpr int kMostRounds = 5;
constexpr double kCloseEnough = 1.004;    // a stretch that no further round is worth
constexpr double kRoundUp = 1.0 + 1e-12;  // of a stretch, against rounding

/// Runs rounds of optimum and proof. Returns the best result, stretched by its remaining excess.
std::optional<RateLaw> quickest(std::span<const Knot> knots, const Limits& limits) {
  Optimum optimum(Grid(knots, limits));
  std::optional<RateLaw> best;
  double best_s = 0.0, factor = 0.0;
  for (int round = 1; round <= kMostRounds; ++round) {
    optimum.run(round == 1 ? kFirstGap : kGap);
    RateLaw law = optimum.law();
    const Proof proof = prove(law, knots, limits);
    if (!proof.is_forward) continue;
    const double stretched_s = law.duration_s() * proof.factor;
    if (!best || stretched_s < best_s) {
      best_s = stretched_s;
      factor = proof.factor;
      best = std::move(law);
    }
    if (factor <= kCloseEnough) break;
    if (round < kMostRounds) optimum.tighten(proof.pieces);
  }
  if (best) best->stretch(factor * kRoundUp);
  return best;
}

/// `limits`: the full limits.
RatePlan plan_of(std::vector<Knot> knots, RateLaw law, const Limits& limits) {
  std::vector<Shares> shares = prove(law, knots, limits).pieces;
  const Shares most = std::accumulate(shares.begin(), shares.end(), Shares{}, greater);
  const RateCurve curve(RateLimits(limits).view(), most);
  return {std::move(knots), std::move(law), std::move(shares), curve};
}

template <class Motion>
RatePlanned plan_motion(const ArmModel& model, const PlanSettings& settings, const Motion& motion,
                        const Joints& start_q, double t_s) {
  const Limits full = limits_of(model, settings, motion);
  const double travel = std::max(length_m(motion), rotation_rad(motion.tool));
  const auto dwell = [&] {
    Knot here;
    std::copy(start_q.begin(), start_q.end(), here.z.begin());
    Knot end = here;
    end.lambda_s = 1.0;
    return plan_of({here, end}, RateLaw(std::max(0.0, t_s)), full);
  };
  if (!(travel > kNoTravel)) return dwell();
  const Limits limits = reserved(full);
  KnotList list = plan_geometry(model, motion, start_q, limits.speed);
  // With low speeds the geometry bends much where joints are quick beside the path; with full speeds it bends
  // less.
  if (std::holds_alternative<PlanRefusal>(list))
    list = plan_geometry(model, motion, start_q, limits_of(model, {}, motion).speed);
  if (auto* refusal = std::get_if<PlanRefusal>(&list)) {
    if (travel < kHardly) return dwell();  // at a singularity
    return std::move(*refusal);
  }
  auto& knots = std::get<std::vector<Knot>>(list);
  std::optional<RateLaw> law = quickest(knots, limits);
  if (!law) {
    PlanRefusal refusal(PlanRefusal::Kind::kLimitExceeded, "P", Quantity::kNumber);
    refusal.text = "no rate along this path was found that keeps all limits: make it shorter";
    return refusal;
  }
  law->last_at_least(t_s);
  return plan_of(std::move(knots), std::move(*law), full);
}

}  // namespace

Limits reserved(Limits limits) noexcept {
  for (double& x : limits.acceleration) x *= 1.0 - kAccelerationReserve;
  for (double& x : limits.jerk) x *= 1.0 - kJerkReserve;
  limits.arc_acceleration *= 1.0 - kAccelerationReserve;
  limits.arc_jerk *= 1.0 - kJerkReserve;
  return limits;
}

RatePlanned plan_rate(const ArmModel& model, const PlanSettings& settings, const LineMotion& line,
                      const Joints& start_q, double t_s) {
  return plan_motion(model, settings, line, start_q, t_s);
}
RatePlanned plan_rate(const ArmModel& model, const PlanSettings& settings, const ArcMotion& arc,
                      const Joints& start_q, double t_s) {
  return plan_motion(model, settings, arc, start_q, t_s);
}

}  // namespace corbot::rate
