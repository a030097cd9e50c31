// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "cell/program.h"

namespace corbot::cli {

/// Starts a cell and its work, and supervises it until a signal: what dies or freezes is started again, the simulated world
/// excepted, with which the cell ends. In a world that was started by itself, the cell goes on by the ledger of that world.
/// Throws client::Failure.
void cell_up(const cell::CellOptions& options);

/// Ends what holds the cell's directory, and waits for its end. Throws client::Failure.
void cell_down(const cell::CellOptions& options);

}  // namespace corbot::cli
