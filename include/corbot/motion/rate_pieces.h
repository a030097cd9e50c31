// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstddef>
#include <span>
#include <type_traits>

// The rate along a path: its parameter lambda as a function of time, from rest to rest, in pieces of constant
// jerk. Real-time safe.

namespace corbot::rate {

/// Lambda and its derivatives by time: s, 1, 1/s, 1/s².
struct RateState {
  double lambda_s{}, v{}, a{}, j{};
};

struct Piece {
  double begin_s{};  ///< time
  RateState begin{};
};

static_assert(std::is_trivially_copyable_v<Piece> && sizeof(Piece) % 8 == 0);

/// The greatest number of pieces of one motion.
inline constexpr std::size_t kMostPieces = 112;

/// Returns the state `t_s` later, at constant jerk.
[[nodiscard]] inline RateState advanced(const RateState& s, double t_s) noexcept {
  return {s.lambda_s + t_s * (s.v + t_s * (s.a / 2.0 + t_s * s.j / 6.0)), s.v + t_s * (s.a + t_s * s.j / 2.0),
          s.a + t_s * s.j, s.j};
}

/// At least one piece. Others own the pieces; the first begins at 0.
struct RatePieces {
  std::span<const Piece> pieces;
  double duration_s{}, length_s{};  ///< time and lambda at the end, at rest

  /// Returns the state within piece number `piece`; `t_s` must be in that piece. The last piece is counted
  /// from its end, where it is exact.
  [[nodiscard]] RateState at(std::size_t piece, double t_s) const noexcept {
    const Piece& p = pieces[piece];
    if (piece + 1 < pieces.size()) return advanced(p.begin, t_s - p.begin_s);
    return advanced({length_s, 0.0, 0.0, p.begin.j}, t_s - duration_s);
  }
  /// Returns the number of the piece in which a time lies; at most seven comparisons.
  [[nodiscard]] std::size_t piece_at(double t_s) const noexcept {
    const auto next = std::upper_bound(pieces.begin() + 1, pieces.end(), t_s,
                                       [](double t, const Piece& piece) { return t < piece.begin_s; });
    return static_cast<std::size_t>(next - pieces.begin()) - 1;
  }
  /// Returns the state at `t_s`, clamped to the duration.
  [[nodiscard]] RateState at(double t_s) const noexcept {
    t_s = std::clamp(t_s, 0.0, duration_s);
    return at(piece_at(t_s), t_s);
  }
};

}  // namespace corbot::rate
