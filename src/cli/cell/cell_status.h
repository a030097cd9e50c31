// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "cell.hh"

namespace corbot::cli {

/// The content of `corbot cell status`.
struct CellView {
  std::string name;
  bool is_paused{false};
  Corbot::CoordinatorState state;
  Corbot::PlaceInfos places;
  Corbot::PieceEvents unclear;
  std::vector<std::string> last_places;  ///< robots bring pieces to these places and take none
  std::string store_fault;               ///< why places and unclear are not known; empty: they are known
  double now_s{0};                       ///< since the Unix epoch
};

/// Returns several complete lines: robots, places, and the cases that need a person, with the remedy.
[[nodiscard]] std::string status_text(const CellView& view);

}  // namespace corbot::cli
