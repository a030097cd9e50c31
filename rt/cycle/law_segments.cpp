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
  for (std::size_t i = 0; i < kCount; ++i) position_[i + 1] = position_in(i, length_s[i]);
}

double LawSegments::time_at(double position, std::size_t* segment) const noexcept {
  constexpr int kSteps = 60;
  std::size_t at = *segment;
  while (at + 1 < kCount && position >= position_[at + 1]) ++at;
  *segment = at;
  const double length_s = begin_s_[at + 1] - begin_s_[at];
  const double way = position_[at + 1] - position_[at];
  if (!(position > position_[at]) || !(way > 0.0)) return begin_s_[at];
  if (position >= position_[at + 1]) return begin_s_[at + 1];
  // Newton's steps, kept between two times that enclose the solution.
  double early_s = 0.0;
  double late_s = length_s;
  double t_s = length_s * (position - position_[at]) / way;
  for (int i = 0; i < kSteps; ++i) {
    const double beyond = position_in(at, t_s) - position;
    if (beyond == 0.0) break;
    (beyond > 0.0 ? late_s : early_s) = t_s;
    const double speed = std::abs(velocity_[at] + t_s * (acceleration_[at] + t_s * jerk_[at] / 2.0));
    double next_s = t_s - beyond / speed;
    if (!(next_s > early_s && next_s < late_s)) next_s = (early_s + late_s) / 2.0;
    const bool is_there = std::abs(next_s - t_s) <= 1e-15 * length_s;
    t_s = next_s;
    if (is_there) break;
  }
  return begin_s_[at] + t_s;
}

}  // namespace corbot::rt
