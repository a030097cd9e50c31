// SPDX-License-Identifier: Apache-2.0
#include "sim/scene/pieces.h"

#include <algorithm>
#include <cmath>
#include <random>
#include <utility>

namespace corbot::sim {

using Eigen::Vector2d;
using Eigen::Vector3d;

namespace {

constexpr double kCorner_rad = std::numbers::pi / 4;  // from a square's side to its diagonal

/// Returns the offsets along, across and above the tool centre point.
Vector3d to_hand(const Hand& hand, const Vector3d& point) {
  const Vector3d offset = point - hand.tool_m;
  return {offset.dot(hand.along()), offset.dot(hand.across), offset.z()};
}

Vector3d to_world(const Hand& hand, const Vector3d& local) {
  return hand.tool_m + local.x() * hand.along() + local.y() * hand.across + local.z() * Vector3d::UnitZ();
}

double yaw_rad(const Hand& hand) { return std::atan2(hand.across.y(), hand.across.x()); }

/// Returns the angle from the hand to the nearest side of a square, from -45 to 45 degrees.
double turn_in(const Hand& hand, const Piece& piece) {
  return std::remainder(piece.yaw_rad - yaw_rad(hand), std::numbers::pi / 2);
}

/// Tells if closing fingers turn the piece. `turn_rad`: as in turn_in.
bool turns(const Piece& piece, double turn_rad) {
  return piece.is_square && kCorner_rad - std::abs(turn_rad) > Pieces::kFriction_rad;
}

/// Returns the turn of a square after the fingers have closed to their opening.
double turn_between(const Hand& hand, const Piece& piece, double turn_rad) {
  if (!turns(piece, turn_rad)) return turn_rad;
  const double share = std::max(hand.opening_m, piece.width_m) / piece.circle_m();
  const double most_rad = std::max(0.0, std::asin(std::min(share, 1.0)) - kCorner_rad);
  return std::clamp(turn_rad, -most_rad, most_rad);
}

}  // namespace

void Pieces::step(std::span<const Hand> hands) {
  for (Piece& piece : pieces_) {
    if (piece.state == PieceState::kFallen) continue;
    if (piece.state == PieceState::kHeld) {
      carry(piece, hands[*piece.hand]);
      continue;
    }
    for (std::size_t i = 0; i < hands.size() && piece.state == PieceState::kStanding; ++i)
      look_between(piece, hands[i], i);
  }
}

void Pieces::take_away(std::size_t index) {
  pieces_.erase(pieces_.begin() + static_cast<std::ptrdiff_t>(index));
}

void Pieces::look_between(Piece& piece, const Hand& hand, std::size_t number) {
  const bool was_between = piece.hand == number;
  if (was_between) piece.hand.reset();
  Vector3d local = to_hand(hand, piece.foot_m);
  const double tool_above_m = -local.z();
  if (std::abs(local.x()) > kAlong_m || tool_above_m < kEnd_m || tool_above_m > piece.height_m - kEnd_m)
    return;
  const double before_rad = piece.is_square ? turn_in(hand, piece) : 0;
  const double turn_rad = was_between ? turn_between(hand, piece, before_rad) : before_rad;
  const double room_m = (hand.opening_m - piece.across_m(turn_rad)) / 2;
  if (!was_between && (2 * room_m < kPlay_m || std::abs(local.y()) > room_m)) return;
  piece.hand = number;
  piece.yaw_rad += turn_rad - before_rad;
  const double least_m = std::max(room_m, 0.0);
  if (std::abs(local.y()) > least_m) {
    local.y() = std::clamp(local.y(), -least_m, least_m);
    piece.foot_m = to_world(hand, local);
  }
  piece.in_hand_rad = turns(piece, turn_rad) ? 0 : turn_rad;
  if (hand.opening_m >= piece.across_m(piece.in_hand_rad) + kPlay_m) return;
  piece.state = PieceState::kHeld;
  piece.in_hand_m = local;
}

void Pieces::carry(Piece& piece, const Hand& hand) {
  const Vector3d before_m = piece.foot_m;
  piece.foot_m = to_world(hand, piece.in_hand_m);
  if (piece.is_square) piece.yaw_rad = yaw_rad(hand) + piece.in_hand_rad;
  push_others(piece, before_m);
  const bool slips = std::exchange(piece.slips, false);
  if (slips || hand.opening_m >= piece.across_m(piece.in_hand_rad) + kPlay_m) release(piece, hand);
}

/// `before_m`: the foot of the held piece a step before. A piece that comes from above pushes nothing.
void Pieces::push_others(const Piece& held, const Vector3d& before_m) {
  constexpr double kTouch_m = 1e-9;
  for (Piece& other : pieces_) {
    if (other.state != PieceState::kStanding) continue;
    if (held.foot_m.z() >= other.foot_m.z() + other.height_m) continue;
    const Vector2d apart_m = (other.foot_m - held.foot_m).head<2>();
    const double least_m = (held.circle_m() + other.circle_m()) / 2;
    if (apart_m.norm() >= least_m) continue;
    if ((other.foot_m - before_m).head<2>().norm() < least_m - kTouch_m) continue;  // it came from above
    const Vector2d away = apart_m.isZero() ? (held.foot_m - before_m).head<2>() : apart_m;
    other.foot_m.head<2>() = held.foot_m.head<2>() + least_m * away.normalized();
    other.foot_m.z() = surface_m_(other.foot_m);
  }
}

void Pieces::release(Piece& piece, const Hand& hand) {
  const double surface_m = surface_m_(piece.foot_m);
  const bool is_taken = std::any_of(pieces_.begin(), pieces_.end(), [&](const Piece& other) {
    const double apart_m = (other.foot_m - piece.foot_m).head<2>().norm();
    return &other != &piece && other.state == PieceState::kStanding &&
           apart_m < (other.circle_m() + piece.circle_m()) / 2;
  });
  const bool stands = std::abs(piece.foot_m.z() - surface_m) <= kDrop_m && !is_taken;
  piece.state = stands ? PieceState::kStanding : PieceState::kFallen;
  if (!stands) {
    piece.hand.reset();
    piece.yaw_rad = std::atan2(hand.along().y(), hand.along().x());
  }
  piece.foot_m.z() = surface_m;
}

std::optional<std::vector<Vector2d>> scatter(const Vector2d& size_m, double spacing_m, std::size_t count,
                                             std::uint64_t seed) {
  if (count == 0) return std::vector<Vector2d>{};
  if (size_m.minCoeff() < 0) return std::nullopt;
  const auto columns = static_cast<std::size_t>(size_m.x() / spacing_m) + 1;
  const auto rows = static_cast<std::size_t>(size_m.y() / spacing_m) + 1;
  if (count > columns * rows) return std::nullopt;
  // Each point has a cell of its own with `spacing_m` to the next ones; its place in the remainder is random.
  const Vector2d cells(static_cast<double>(columns), static_cast<double>(rows));
  const Vector2d free_m = (size_m - spacing_m * (cells - Vector2d::Ones())).cwiseQuotient(cells);
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> share(0, 1);
  std::vector<Vector2d> points;
  for (std::size_t i = 0; i < columns * rows; ++i) {
    const std::size_t row = i / columns;
    const Vector2d cell(static_cast<double>(i % columns), static_cast<double>(row));
    const double x = share(random);
    const double y = share(random);
    points.emplace_back(cell.cwiseProduct(free_m + Vector2d::Constant(spacing_m)) +
                        free_m.cwiseProduct(Vector2d(x, y)) - size_m / 2);
  }
  std::shuffle(points.begin(), points.end(), random);
  points.resize(count);
  return points;
}

}  // namespace corbot::sim
