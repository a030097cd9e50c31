// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "cell.hh"
#include "cell/cell_config.h"

// Selects the next piece of a robot and its target slot. Positions are in the world frame, in metres.

namespace corbot::cell {

/// A piece that a robot can take. `number` is 0 if the piece is not in the ledger yet.
struct Candidate {
  std::int64_t number{};
  std::string kind;
  std::optional<int> slot;  ///< nothing: in an area
  Eigen::Vector3d position_m{};
  double yaw_deg{};
  std::int64_t arrived{};  ///< rises with the time of arrival
};

/// Distances that differ by less count as equal. For so small a difference the robot's hand comes no closer
/// to a piece behind.
inline constexpr double kEqualDistance_m = 0.02;

/// Returns the candidate nearest to a robot. Among equal distances it returns the oldest.
[[nodiscard]] std::optional<Candidate> nearest_piece(const std::vector<Candidate>& candidates,
                                                     const Eigen::Vector3d& robot);

/// Returns the free slot for a kind that is farthest from a robot. Among equal distances it returns the
/// lowest.
[[nodiscard]] std::optional<int> farthest_slot(const Place& place, const std::set<int>& taken,
                                               const std::string& kind, const Eigen::Vector3d& robot);

/// Returns the sightings on an area of known kinds that are not the piece at one of the spots `taken`, in
/// their order. A sighting within the kind's radius of a spot is the same piece: two pieces cannot stand so
/// close.
[[nodiscard]] std::vector<Candidate> untaken(const CellConfig& cell, const Place& area,
                                             const Corbot::Sightings& seen,
                                             const std::vector<Eigen::Vector3d>& taken);

}  // namespace corbot::cell
