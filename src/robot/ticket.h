// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>

#include "corbot/channel/records.h"
#include "corbot/channel/servant_state.h"
#include "planner/plan/plan.h"

namespace corbot {

/// One accepted motion: one or two consecutive commands. Its number is that of its last command.
struct Ticket {
  std::uint64_t first{};
  std::uint64_t last{};
  double duration_s{};           ///< of all its commands, at override 100 %
  double second_from_s{};        ///< when the second command begins, within duration_s
  std::uint64_t incarnation{};   ///< incarnation of the real-time task that has the commands
  std::uint64_t epoch{};         ///< number of stops when its call arrived
  PlanStart end;                 ///< where the arm rests when the motion is done
  std::uint64_t handed_until{};  ///< see TicketRecord
  bool cancelled{false};         ///< a Cancel has cancelled it
  TicketState state{TicketState::kPending};
  TicketReason why{};
  std::size_t place{};  ///< index of its record
  std::string reason;   ///< empty unless stopped or failed
};

/// Return the state and the reason of a motion that ended with this verdict.
[[nodiscard]] TicketState state_of(Verdict verdict);
[[nodiscard]] TicketReason reason_of(Verdict verdict);
/// Returns "" for no reason.
[[nodiscard]] const char* to_string(TicketReason reason);
/// Returns true if such a state can have such a reason; false also for invalid values.
[[nodiscard]] bool is_consistent(TicketState state, TicketReason reason);

[[nodiscard]] TicketRecord to_record(const Ticket& ticket);
/// Converts a record that was checked.
[[nodiscard]] Ticket to_ticket(const TicketRecord& record);

}  // namespace corbot
