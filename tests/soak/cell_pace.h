// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <map>
#include <string>
#include <vector>

#include "cell/activity.h"

namespace corbot::soak {

/// A motion that has begun, with the duration that its servant planned.
struct PlannedMotion {
  double begin_s{};  ///< Unix epoch
  double duration_s{};
};

/// By robot.
using PlannedMotions = std::map<std::string, std::vector<PlannedMotion>>;

/// How fast robot2 ends pieces, and what both robots do meanwhile in the zone. A picture has no plan: its
/// time is the record's in both sums.
struct Pace {
  double seconds{};        ///< from the first piece in work to the last end
  double zone_share{};     ///< of the whole record from that piece on
  double median_s{};       ///< from a piece's end to the next one
  double planned_s{};      ///< motions as planned, and looks, in the zone, a piece
  double carried_out_s{};  ///< the same as carried out
};

/// All 0 where fewer than two pieces have ended.
[[nodiscard]] Pace pace_of(const std::vector<cell::ActivityChange>& changes, const PlannedMotions& motions);
/// Names each wanted bound that the pace misses; empty: none.
[[nodiscard]] std::string missed_bounds(const Pace& pace);

}  // namespace corbot::soak
