// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>

#include "corbot/motion/law_evaluation.h"

// What a law asks of the tool along a line or an arc. The planner keeps these within the arm's path limits
// and the real-time task checks the same numbers. Real-time safe.

namespace corbot {

/// Magnitudes of the tool's velocity, acceleration and jerk as vectors: m/s, m/s², m/s³.
struct ToolPeaks {
  double speed_m_s{};
  double acceleration_m_s2{};
  double jerk_m_s3{};
};

/// Bounds of the vectors over the whole law; `curvature_1_m`: 0 for a line. On an arc v²/R towards the
/// centre adds to the acceleration along, and the jerk is (j + v³/R², 3 v a/R). The law's peaks are taken as
/// if they came at one instant, so these are upper bounds, reached on a line.
[[nodiscard]] inline ToolPeaks tool_peaks(const LawPeaks& law, double length_m,
                                          double curvature_1_m) noexcept {
  const double v = law.velocity * length_m;
  const double a = law.acceleration * length_m;
  const double j = law.jerk * length_m;
  const double k = curvature_1_m;
  return {v, std::hypot(a, v * v * k), std::hypot(j + v * v * v * k * k, 3.0 * v * a * k)};
}

}  // namespace corbot
