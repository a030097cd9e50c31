// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "cell.hh"
#include "cell/cell_config.h"

// Which piece a robot takes next, and to which slot it goes. Positions: world, metres.

namespace corbot::cell {

/// A piece that can be taken. `number` is 0 where the piece is not in the ledger yet.
struct Candidate {
  std::int64_t number{};
  std::string kind;
  std::optional<int> slot;  ///< nothing in an area
  Eigen::Vector3d position_m{};
  double yaw_deg{};
  std::int64_t arrived{};  ///< rises with the time of arrival
};

/// Distances that differ by less are equal: a robot's hand does not come nearer to a piece behind.
inline constexpr double kEqualDistance_m = 0.02;

/// The candidate nearest to a robot; the oldest of those as near.
[[nodiscard]] std::optional<Candidate> nearest_piece(const std::vector<Candidate>& candidates,
                                                     const Eigen::Vector3d& robot);

/// The slot farthest from a robot that is not taken; the lowest of those as far.
[[nodiscard]] std::optional<int> farthest_slot(const Place& place, const std::set<int>& taken,
                                               const Eigen::Vector3d& robot);

/// The first sighting of a piece that an area carries, that is of a known kind and not the piece at one of the spots `taken`.
/// A sighting nearer than the kind's radius is that piece: two pieces cannot stand so near to each other.
[[nodiscard]] std::optional<Candidate> first_untaken(const CellConfig& cell, const Place& area,
                                                     const Corbot::Sightings& seen,
                                                     const std::vector<Eigen::Vector3d>& taken);

}  // namespace corbot::cell
