// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstdint>
#include <variant>

#include "planner/rate/rate_planner.h"
#include "rt/rig.h"

namespace corbot::test {

/// A line at all limits, as a servant would hand it over; of `t_s` if that takes longer.
inline Command with_rate(Rig& rig, Command line, std::uint16_t slot, double t_s = 0.0) {
  const auto plan = std::get<rate::RatePlan>(rate::plan_rate(rig.arm, {}, line.line, line.start_q, t_s));
  line.duration_s = plan.law.duration_s();
  std::copy_n(plan.knots.back().z.begin(), line.end_q.size(), line.end_q.begin());
  line.line.knots = {slot, static_cast<std::uint16_t>(plan.knots.size()),
                     static_cast<std::uint16_t>(plan.law.pieces().size())};
  RateSlot& to = rig.servant->rates[slot];
  std::copy(plan.knots.begin(), plan.knots.end(), to.knots.begin());
  std::copy(plan.law.pieces().begin(), plan.law.pieces().end(), to.pieces.begin());
  return line;
}

}  // namespace corbot::test
