// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "corbot/motion/path.h"
#include "planner/plan/plan.h"
#include "rt/cycle/command_check.h"
#include "rt/cycle/path_evaluation.h"
#include "rt/cycle/rate_check.h"

namespace corbot::test {

/// Whether the real-time task accepts what was planned: as the cycle does, a few cells a call. `rate`: of a
/// line or an arc.
inline Verdict gate(const ArmModel& arm, Command command, const PlannedRate& rate = {}) {
  command.id = 1;
  const Verdict verdict = rt::check_command(arm, command, {0, command.start_q, 0.0}).verdict;
  if (verdict != Verdict::kDone || rate.pieces.empty()) return verdict;
  ArmModel framed = arm;
  rt::take_frames(command, framed.kinematics);
  const rate::RatePath path{rate.knots, {rate.pieces, command.duration_s, rate.knots.back().lambda_s}};
  rt::RateCheck check;
  for (;;) {
    if (const auto done = check.step(framed, command, path)) return done->verdict;
  }
}

}  // namespace corbot::test
