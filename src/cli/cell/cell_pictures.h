// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <optional>
#include <vector>

#include "cell/cell_config.h"
#include "cell/scene_record.h"
#include "cli/cell/verdict.h"

// Pictures of a run for people, which `corbot cell run --pictures DIR` writes to DIR.

namespace corbot::cli {

/// Creates the directory, before anything starts. Throws client::Failure if no file can be written there.
void prepare_pictures(const std::filesystem::path& directory);

/// A run that has ended. Only a simulated cell has a `record`.
struct RunPictures {
  const cell::CellConfig& cell;
  const std::optional<cell::SceneRecord>& record;
  const CellEnd& end;
};

/// Writes cell.svg, gantt.svg and camera.jpg as far as their data exist, and returns their paths. Throws
/// client::Failure if a file cannot be written.
std::vector<std::filesystem::path> write_pictures(const std::filesystem::path& directory,
                                                  const RunPictures& pictures);

}  // namespace corbot::cli
