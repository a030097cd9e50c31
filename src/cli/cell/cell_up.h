// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>

#include "cell/program.h"

namespace corbot::cli {

/// Starts a cell and its work, and supervises it until a signal. Restarts processes that die or freeze,
/// except the simulated world, with which the cell ends. In a world that was started separately, the cell
/// continues with the ledger of that world. `panel` is the port of a panel that it starts, too; 0: any free
/// one. Throws client::Failure.
void cell_up(const cell::CellOptions& options, std::optional<int> panel);

/// Ends the process that holds the cell's directory, and waits for its end. Throws client::Failure.
void cell_down(const cell::CellOptions& options);

}  // namespace corbot::cli
