// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>

namespace corbot::soak {

struct CellSoak {
  int kills{300};
  int pieces{8};  ///< of a world; a next one begins where they have arrived
  std::uint64_t seed{};
  bool verbose{false};
  std::string planted{};  ///< the fault of planted_coordinator.cpp that is to be found; empty: none
  std::filesystem::path programs;
  std::filesystem::path results;  ///< each run adds its lines
};

/// Kills or freezes any process of a cell but its world, at random instants, one in five with a second. Each
/// world must end with every piece on pallet2, and a person may be asked only where docs/cell.md says so. The
/// exit code; with a planted fault 0 means that the soak has found the fault.
int run_cells(const CellSoak& soak);

}  // namespace corbot::soak
