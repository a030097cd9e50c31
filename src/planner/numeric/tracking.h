// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>

#include "corbot/arm/arm_model.h"
#include "corbot/motion/path_knots.h"
#include "planner/numeric/path_function.h"
#include "planner/numeric/piece_bounds.h"

namespace corbot::numeric {

/// How far the tool may be off the path that was asked for (m and rad), everywhere.
inline constexpr double kTracking = 1e-6;

/// How well pieces between knots follow a path: the tool at the piece's joints against the path's point. Model and path outlive this.
class Tracking {
 public:
  Tracking(const ArmModel& model, const PathFunction& path);

  /// Greatest of position (m) and orientation, or followed angles (rad), at a few points of the piece.
  [[nodiscard]] double sampled(const KnotPiece& piece) const noexcept;

  /// Whether the tool is within kTracking on the whole piece. Between two samples that are δ apart the error is no greater than the
  /// greater of both and δ²/8 times the greatest second derivative of the error; that is bounded from the bounds of the joints'
  /// derivatives and the greatest distances that the axes can have from the tool. Rounding is not directed: it is six digits down.
  [[nodiscard]] bool proves(const KnotPiece& piece) const noexcept;

 private:
  struct Error {
    double position_m{};
    /// Length of the vector part of the quaternion between the two orientations, or half of what a followed angle is off.
    double half_sine{};
  };
  [[nodiscard]] Error error(const KnotPiece& piece, double t) const noexcept;
  [[nodiscard]] double bend_of_position(const PieceBounds& bounds) const noexcept;
  [[nodiscard]] double bend_of_half_sine(const PieceBounds& bounds) const noexcept;

  const ArmModel& model_;
  const PathFunction& path_;
  std::size_t count_;
  bool is_full_;
  FollowedAngles followed_;
  Joints lever_{};  ///< greatest distance of the tool from an axis that turns; 1 of a slide
};

}  // namespace corbot::numeric
