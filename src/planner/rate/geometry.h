// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <variant>
#include <vector>

#include "corbot/arm/arm_model.h"
#include "planner/plan.h"

// A line or an arc as a curve z = (q, s) of joints and path parameter, by its length lambda. Lengths are measured in the time that full speed
// takes: d lambda² = Σ (dq_i / v_i)² + (ds / v_s)², v the full speeds. So lambda counts in seconds and |dz_i / d lambda| <= v_i everywhere.
// Next to a singularity q goes as √s, hence s as lambda²: there, too, z is smooth in lambda.

namespace corbot::rate {

/// Joints (rad or m), zeros beyond the arm's, then the path parameter s in [0, 1].
using State = std::array<double, kMaxJoints + 1>;
inline constexpr std::size_t kPath = kMaxJoints;  ///< index of s

struct Knot {
  double lambda_s{};
  State z{};
  State rate{};  ///< dz/d lambda, of length 1 in the metric above
  State bend{};  ///< d²z/d lambda²
};

/// The polynomials of the fifth degree between two knots that meet both with two derivatives.
class Cell {
 public:
  Cell(const Knot& a, const Knot& b) noexcept : Cell(a, b, b.lambda_s - a.lambda_s) {}
  /// `length_s`: in place of the difference of the knots' lambda; positive.
  Cell(const Knot& a, const Knot& b, double length_s) noexcept;

  [[nodiscard]] double length_s() const noexcept { return length_s_; }
  /// `t`: part of the cell, 0 … 1. `order`: of the derivative by lambda, 0 … 5.
  [[nodiscard]] State at(double t, std::size_t order = 0) const noexcept;

 private:
  double length_s_;
  std::array<std::array<double, 6>, kMaxJoints + 1> c_{};  ///< Σ c[k]·t^k
};

/// Full speeds of z, at the settings' ratios: of each joint (rad or m, a second), and of s (1/s), at which tool and tool's turning keep
/// their speeds. Both zero: infinite.
[[nodiscard]] State full_speed(const ArmModel& model, const PlanSettings& settings, double length_m,
                               double rotation_rad) noexcept;

using KnotList = std::variant<std::vector<Knot>, PlanRefusal>;

/// Knots from s = 0 to s = 1, at most kMostKnots, the first with lambda 0. At a few points of each cell the tool is within 1e-8 m (rad) of
/// the path. There each joint's third derivative is right to 3 % of its jerk limit. A path that would need more knots gets 1e-7 and 60 %.
/// `start_q`: joints at the first point. `speed`: by full_speed, all of the arm's entries finite and positive.
/// A path may begin or end at a singularity if the arm has a closed form. It may lead through one where the curve goes on smoothly on
/// another solution. There the tool is within 5e-7 m (rad) of the path, so a path that misses the place by less is led through it. Refused:
/// a path that leaves the reach, leads through any other singularity, or needs too many knots. Joint ranges are not looked at.
[[nodiscard]] KnotList plan_geometry(const ArmModel& model, const LineMotion& line, const Joints& start_q,
                                     const State& speed);
[[nodiscard]] KnotList plan_geometry(const ArmModel& model, const ArcMotion& arc, const Joints& start_q,
                                     const State& speed);

}  // namespace corbot::rate
