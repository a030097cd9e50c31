// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>
#include <variant>

#include "client/request.h"

namespace corbot::panel {

enum class CellAction { kStart, kPause, kResolve, kExchange };

/// An order for a cell. Resolve and Exchange are a person's words for the ledger: see idl/cell.idl.
struct CellRequest {
  CellAction action{};
  std::uint64_t piece{0};  ///< that kResolve is about
  std::string place{};     ///< of kExchange and kResolve; empty: the piece was taken away
  std::int32_t slot{-1};   ///< of the place; −1: the place is an area
};

/// A request to a robot or to a cell by /api/call.
using Order = std::variant<client::Request, CellRequest>;

/// Returns whether the order may start a motion, or let one go on.
[[nodiscard]] inline bool starts_motion(const Order& order) {
  if (const auto* cell = std::get_if<CellRequest>(&order)) return cell->action == CellAction::kStart;
  const client::Verb verb = std::get<client::Request>(order).verb;
  return verb == client::Verb::kResume || client::spec_of(verb).motion;
}

}  // namespace corbot::panel
