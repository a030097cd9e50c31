// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "cell.hh"

namespace corbot::cli {

/// What `corbot cell status` prints.
struct CellView {
  std::string name;
  bool is_paused{false};
  Corbot::CoordinatorState state;
  Corbot::PlaceInfos places;
  Corbot::PieceEvents unclear;
  std::vector<std::string> last_places;  ///< robots bring pieces there, and take none
  std::string store_fault;               ///< why places and unclear are not known; empty: they are
  double now_s{0};                       ///< since the Unix epoch
};

/// Several lines, each with its end: robots, places, and what needs a person with what to do.
[[nodiscard]] std::string status_text(const CellView& view);

}  // namespace corbot::cli
