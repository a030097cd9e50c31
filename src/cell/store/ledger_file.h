// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "cell/cell_config.h"
#include "cell/store/database.h"

namespace corbot::cell {

/// Opens the cell's ledger, and creates it if necessary. Throws DatabaseError. Throws client::Failure,
/// kUsage, for the ledger of another cell or schema, and if the ledger uses places, slots or robots that the
/// cell lacks.
[[nodiscard]] Database open_ledger(const CellConfig& cell);

}  // namespace corbot::cell
