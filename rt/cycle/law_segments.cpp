// SPDX-License-Identifier: Apache-2.0
#include "rt/cycle/law_segments.h"

#include <cmath>

#include "corbot/motion/law_evaluation.h"

namespace corbot::rt {

LawSegments::LawSegments(const TimeLaw& law) noexcept {
  const std::array<double, kCount> length_s{law.t_jerk_s, law.t_acc_s, law.t_jerk_s, law.t_cruise_s,
                                            law.t_jerk_s, law.t_acc_s, law.t_jerk_s};
  for (std::size_t i = 0; i < kCount; ++i) begin_s_[i + 1] = begin_s_[i] + length_s[i];

  const LawPeaks peak = peaks(law);
  const double sign = law.distance < 0.0 ? -1.0 : 1.0;
  const double v = sign * peak.velocity;
  const double a = sign * peak.acceleration;
  const double j = sign * peak.jerk;
  // Velocity after the first jerk segment; by symmetry v − v_jerk before the last of the rise.
  const double v_jerk = a * law.t_jerk_s / 2.0;
  velocity_ = {0.0, v_jerk, v - v_jerk, v, v, v - v_jerk, v_jerk};
  acceleration_ = {0.0, a, a, 0.0, 0.0, -a, -a};
  jerk_ = {j, 0.0, -j, 0.0, -j, 0.0, j};
}

}  // namespace corbot::rt
