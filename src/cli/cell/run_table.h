// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "cli/cell/work_history.h"

namespace corbot::cli {

/// The figures after a run besides its history. Figures that a cell does not measure are omitted.
struct RunFigures {
  std::optional<double> both_move_share;  ///< part of the time, 0 to 1; the simulation measures it
  std::optional<double> nearest_mm;       ///< between two arms
  std::vector<std::pair<std::string, std::uint64_t>> overruns;  ///< program -> number of late cycles
};

/// Returns a line for each figure: its name, then its value. Empty if no figure is known.
[[nodiscard]] std::vector<std::string> run_table(const WorkHistory& history, const RunFigures& figures);

}  // namespace corbot::cli
