// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>

#include "cell/cell_config.h"

// Pictures of a run for people, which `corbot cell run --pictures DIR` leaves in DIR.

namespace corbot::cli {

/// Before anything starts: makes the directory. Throws client::Failure where no file can be written there.
void prepare_pictures(const std::filesystem::path& directory);

/// At the end of a run, when all programs have ended. cell.svg is of a simulated cell only. Throws
/// client::Failure.
void write_pictures(const std::filesystem::path& directory, const cell::CellConfig& cell);

}  // namespace corbot::cli
