// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "cli/cell/work_history.h"

namespace corbot::cli {

/// What the table after a run shows besides its history. What a cell does not measure is left out.
struct RunFigures {
  std::optional<double> both_move_share;  ///< of the time, 0 to 1; the simulation measures it
  std::optional<double> nearest_mm;       ///< between two arms
  std::vector<std::pair<std::string, std::uint64_t>> overruns;  ///< program -> cycles that came late
};

/// A line for each figure: its name, then its value. Empty where nothing is known.
[[nodiscard]] std::vector<std::string> run_table(const WorkHistory& history, const RunFigures& figures);

}  // namespace corbot::cli
