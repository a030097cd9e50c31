// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "corbot/motion/path_knots.h"

namespace corbot::numeric {

/// Bounds that hold everywhere on a stretch of a piece, a unit of s.
struct PieceBounds {
  Joints rate_q{};  ///< of |dq/ds|
  Joints bend_q{};  ///< of |d²q/ds²|
};

/// From t_a to t_b, parts of the piece. A polynomial lies between its least and its greatest Bernstein coefficient (Farouki, Computer
/// Aided Geometric Design 29, 2012), which it reaches as the stretch gets shorter.
[[nodiscard]] PieceBounds bound_piece(const KnotPiece& piece, double t_a, double t_b) noexcept;

/// dq/ds at t.
[[nodiscard]] Joints rate_at(const KnotPiece& piece, double t) noexcept;

}  // namespace corbot::numeric
