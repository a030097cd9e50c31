// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <sys/types.h>

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "cell/cell_config.h"

// How programs of this user find the cells that run on this machine: by the lock of the state directory, and
// the file with the cell's addresses.

namespace corbot::cell {

/// File in the state directory with the addresses of the cell's programs and robots.
inline constexpr const char* kAddresses = "cell.json";
/// File in the state directory that the process of a running cell has locked.
inline constexpr const char* kLock = "lock";

/// Returns the process that holds the state directory, or nothing.
[[nodiscard]] std::optional<pid_t> holder_of(const std::filesystem::path& directory);

/// Writes kAddresses for a running cell, whose description is `file`. Throws client::Failure.
void publish_addresses(const CellConfig& cell, const std::filesystem::path& file);

/// Returns the state directories of the cells that run, among those without --state-dir; sorted.
[[nodiscard]] std::vector<std::filesystem::path> running_cells();

/// Returns the cell that a person names by its description, its state directory, or its name. By directory or
/// name the cell must run, and has the name and the ports of its start. Throws client::Failure and
/// ConfigError.
[[nodiscard]] CellConfig find_cell(const std::string& word);

}  // namespace corbot::cell
