// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <CLI/CLI.hpp>

#include "cell/program.h"

namespace corbot::cli {

struct CellRunOptions {
  cell::CellOptions cell;
  std::filesystem::path pictures;  ///< a directory; empty: none
  bool until_eof{false};           ///< the end of standard input ends the cell
};

/// Starts a cell, supervises it until its work is done, and ends it; see corbot(1). Throws client::Failure: wrong cell.toml kUsage, no
/// robot or camera kUnreachable, Ctrl-C or a Stop kStopped, a port in use kInternal, all else that ends the work early kRefused.
void cell_run(const CellRunOptions& options);

}  // namespace corbot::cli
