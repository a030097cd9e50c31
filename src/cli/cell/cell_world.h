// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>

#include "cell/cell_config.h"
#include "shm/descriptor.h"

namespace corbot::cli {

/// A simulated world that was started by itself, as `corbot-scene CELL`. It outlives a cell, as real servos and pieces do.
class CellWorld {
 public:
  /// The one that listens in the cell's directory; nothing: there is none. Throws client::Failure.
  [[nodiscard]] static std::optional<CellWorld> find(const cell::CellConfig& cell);

  /// Whether the ledger is of this world, and not of one before.
  [[nodiscard]] bool has_ledger() const;
  /// From now on the ledger is of this world. Throws client::Failure.
  void take_ledger() const;
  [[nodiscard]] bool has_ended() const;

 private:
  CellWorld(Descriptor process, std::string identity, std::filesystem::path file)
      : process_(std::move(process)), identity_(std::move(identity)), file_(std::move(file)) {}

  Descriptor process_;
  std::string identity_;        ///< no other world in this directory has it
  std::filesystem::path file_;  ///< the identity of the world that the ledger is of
};

}  // namespace corbot::cli
