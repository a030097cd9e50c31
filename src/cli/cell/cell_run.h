// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>

#include "cell/program.h"

namespace corbot::cli {

struct CellRunOptions {
  cell::CellOptions cell;
  std::optional<int> panel;        ///< port of a panel; 0: any free one, nothing: no panel
  std::filesystem::path pictures;  ///< a directory; empty: none
  bool until_eof{false};           ///< the end of standard input ends the cell
};

/// Starts a cell, supervises it until its work is done, and ends it; see corbot(1). Throws client::Failure.
/// The code is kUsage for an invalid cell.toml, kUnreachable without a robot or camera, kStopped after Ctrl-C
/// or a Stop. It is kInternal if a port is in use, and kRefused for any other early end.
void cell_run(const CellRunOptions& options);

}  // namespace corbot::cli
