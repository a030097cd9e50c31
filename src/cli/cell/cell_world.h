// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>

#include "cell/cell_config.h"
#include "shm/descriptor.h"

namespace corbot::cli {

/// A simulated world that was started separately, as `corbot-scene CELL`. It outlives a cell, like real
/// servos and pieces.
class CellWorld {
 public:
  /// Returns the world that listens in the cell's directory, or nothing. Throws client::Failure.
  [[nodiscard]] static std::optional<CellWorld> find(const cell::CellConfig& cell);

  /// Returns true if the ledger belongs to this world, not to an earlier one.
  [[nodiscard]] bool has_ledger() const;
  /// Assigns the ledger to this world from now on. Throws client::Failure.
  void take_ledger() const;
  [[nodiscard]] bool has_ended() const;

 private:
  CellWorld(Descriptor process, std::string identity, std::filesystem::path file)
      : process_(std::move(process)), identity_(std::move(identity)), file_(std::move(file)) {}

  Descriptor process_;
  std::string identity_;        ///< unique among the worlds in this directory
  std::filesystem::path file_;  ///< contains the identity of the ledger's world
};

}  // namespace corbot::cli
