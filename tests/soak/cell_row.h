// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "soak/cell_soak.h"

namespace corbot::soak {

/// Pieces in a row without a fault, while a person refills the first place and empties the last one. Prints
/// what the cell achieved. The exit code: 1 where a person was needed, a piece was lost or the world differs
/// from the ledger.
int run_row(const CellSoak& soak, int pieces);

}  // namespace corbot::soak
