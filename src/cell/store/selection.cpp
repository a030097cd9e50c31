// SPDX-License-Identifier: Apache-2.0
#include "cell/store/selection.h"

#include <algorithm>
#include <limits>

namespace corbot::cell {
namespace {

using Eigen::Vector3d;

double distance(const Vector3d& a, const Vector3d& b) { return (a - b).head<2>().norm(); }

}  // namespace

std::optional<Candidate> nearest_piece(const std::vector<Candidate>& candidates, const Vector3d& robot) {
  double least = std::numeric_limits<double>::infinity();
  for (const Candidate& each : candidates) least = std::min(least, distance(each.position_m, robot));
  const Candidate* chosen = nullptr;
  for (const Candidate& each : candidates) {
    if (distance(each.position_m, robot) > least + kEqualDistance_m) continue;
    if (chosen == nullptr || each.arrived < chosen->arrived) chosen = &each;
  }
  return chosen == nullptr ? std::nullopt : std::optional(*chosen);
}

std::optional<int> farthest_slot(const Place& place, const std::set<int>& taken, const std::string& kind,
                                 const Vector3d& robot) {
  const auto is_free = [&](int slot) { return taken.count(slot) == 0 && place.slot_takes(slot, kind); };
  double most = -1;
  for (int slot = 0; slot < place.slots->count(); ++slot)
    if (is_free(slot)) most = std::max(most, distance(place.slot_position(slot), robot));
  for (int slot = 0; slot < place.slots->count(); ++slot)
    if (is_free(slot) && distance(place.slot_position(slot), robot) >= most - kEqualDistance_m) return slot;
  return std::nullopt;
}

std::vector<Candidate> untaken(const CellConfig& cell, const Place& area, const Corbot::Sightings& seen,
                               const std::vector<Vector3d>& taken) {
  std::vector<Candidate> found;
  for (CORBA::ULong i = 0; i < seen.length(); ++i) {
    const Corbot::Sighting& each = seen[i];
    const Vector3d position(each.position.x, each.position.y, each.position.z);
    const Kind* kind = cell.kind(each.kind.in());
    if (kind == nullptr || !area.carries(position)) continue;
    const auto is_it = [&](const Vector3d& spot) { return distance(spot, position) < kind->width_m / 2; };
    if (std::any_of(taken.begin(), taken.end(), is_it)) continue;
    found.push_back({0, kind->name, std::nullopt, position, each.yaw, 0});
  }
  return found;
}

}  // namespace corbot::cell
