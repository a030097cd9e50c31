// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "cell/cell_config.h"
#include "cell/store/database.h"

namespace corbot::cell {

/// Opens the cell's ledger, and makes it where it is not there. Throws DatabaseError; client::Failure, kUsage, for the ledger of
/// another cell or another schema, and for one with places, slots or robots that the cell does not have.
[[nodiscard]] Database open_ledger(const CellConfig& cell);

}  // namespace corbot::cell
