// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <numbers>
#include <optional>
#include <span>
#include <vector>

#include <Eigen/Core>

#include "sim/scene/arm_body.h"

namespace corbot::sim {

enum class PieceState { kStanding, kHeld, kFallen };

/// An upright cylinder or square prism. World, metres.
struct Piece {
  std::size_t kind{};
  double width_m{};  ///< diameter, or side of a square
  double height_m{};
  /// The middle of its foot; for a fallen piece, of its side on the surface.
  Eigen::Vector3d foot_m{Eigen::Vector3d::Zero()};
  PieceState state{PieceState::kStanding};
  double yaw_rad{0};  ///< fallen: direction of its axis; upright and square: direction of a side
  /// The hand with the piece between its fingers; held: the hand that holds it.
  std::optional<std::size_t> hand{};
  Eigen::Vector3d in_hand_m{Eigen::Vector3d::Zero()};  ///< held: its foot along, across and above the tool
  double in_hand_rad{0};                               ///< held: its yaw less the hand's
  bool slips{false};                                   ///< held: the next step releases it
  bool is_square{false};

  /// Returns the diameter of the circle around it.
  [[nodiscard]] double circle_m() const { return is_square ? std::numbers::sqrt2 * width_m : width_m; }
  /// Returns the extent in the direction in which fingers close, `turn_rad` from a square's side.
  [[nodiscard]] double across_m(double turn_rad) const {
    return is_square ? width_m * (std::abs(std::cos(turn_rad)) + std::abs(std::sin(turn_rad))) : width_m;
  }
};

/// The pieces, and the hands' effects on them. A standing piece is between the fingers if the tool centre
/// point is next to its axis. Across, it must be within the room that opening and width across leave; along
/// the hand, within `kAlong_m`. The point must be `kEnd_m` or more from both ends of the piece. Fingers push
/// a piece between them until the hand moves away from it. They hold the piece once their opening is below
/// its width across and `kPlay_m`: it follows the tool, upright. A released piece stands if its foot is
/// within `kDrop_m` of the surface, above or below, and no other piece stands there. Otherwise it falls, and
/// stays there. A held piece that moves sideways pushes standing pieces out of its way, without inertia. A
/// pushed piece pushes no other one.
/// A square between closing fingers touches them at two opposite corners. The fingers turn it into line if
/// the line through these corners is outside of the friction cone, which is within `kFriction_rad` of the
/// direction in which they close. Within the cone the square does not turn, and they hold it at the corners.
/// Towards other pieces a square counts as the circle around it.
class Pieces {
 public:
  static constexpr double kPlay_m = 0.001;
  static constexpr double kAlong_m = 0.008;
  static constexpr double kEnd_m = 0.005;
  static constexpr double kDrop_m = 0.005;
  static constexpr double kFriction_rad = std::numbers::pi / 12;

  /// `surface_m`: height of the surface at a point.
  Pieces(std::vector<Piece> pieces, std::function<double(const Eigen::Vector3d&)> surface_m)
      : pieces_(std::move(pieces)), surface_m_(std::move(surface_m)) {}

  /// Takes the present hands; their order is always the same.
  void step(std::span<const Hand> hands);
  /// Adds one more piece, as if a person put it down.
  void put_down(const Piece& piece) { pieces_.push_back(piece); }
  /// Makes a held piece slip out of its closed hand at the next step, for a test.
  void drop(std::size_t index) { pieces_[index].slips = true; }
  /// Removes the piece of this index, as if a person took it; the later ones move up.
  void take_away(std::size_t index);

  [[nodiscard]] const std::vector<Piece>& all() const { return pieces_; }

 private:
  void look_between(Piece& piece, const Hand& hand, std::size_t number);
  void carry(Piece& piece, const Hand& hand);
  void push_others(const Piece& held, const Eigen::Vector3d& before_m);
  void release(Piece& piece, const Hand& hand);

  std::vector<Piece> pieces_;
  std::function<double(const Eigen::Vector3d&)> surface_m_;
};

/// Returns random points in a rectangle about the origin, at least `spacing_m` from each other. Returns
/// nothing if `count` exceeds the rows and columns that fit into the rectangle. The same seed gives the same
/// points.
[[nodiscard]] std::optional<std::vector<Eigen::Vector2d>> scatter(const Eigen::Vector2d& size_m,
                                                                  double spacing_m, std::size_t count,
                                                                  std::uint64_t seed);

}  // namespace corbot::sim
