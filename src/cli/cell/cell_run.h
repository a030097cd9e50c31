// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <CLI/CLI.hpp>

#include "cell/program.h"

namespace corbot::cli {

/// `corbot cell`, with its own commands.
void add_cell(CLI::App& app);

/// Starts a cell, supervises it until its work is done, and ends it; see corbot(1). Throws client::Failure: wrong cell.toml kUsage, no
/// robot or camera kUnreachable, Ctrl-C or a Stop kStopped, a port in use kInternal, all else that ends the work early kRefused.
void cell_run(const cell::CellOptions& options);

}  // namespace corbot::cli
