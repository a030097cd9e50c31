// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "corbot/arm/arm_model.h"
#include "corbot/channel/layout.h"
#include "planner/plan/plan.h"
#include "robot/alarm_log.h"
#include "robot/ticket.h"

namespace corbot {

/// The valid part of the state that the previous servant left.
struct InheritedState {
  std::optional<PlanSettings> settings;
  std::vector<AlarmEntry> alarms;  ///< oldest first
  std::vector<Ticket> tickets;     ///< ordered by number
  std::optional<ControlRecord> control;
  std::string held_by;  ///< the client that requested the last StopAndHold; empty: not known
  int invalid{0};       ///< number of omitted records, which no servant of this robot writes
};

/// Reads the state that another process wrote. Copies every record once and checks each of its fields; a torn
/// or invalid record does not affect the others. `next_command_id` of the new servant is beyond all valid
/// numbers.
[[nodiscard]] InheritedState read_inherited(const ServantSegment& former, const ArmModel& arm,
                                            std::uint64_t next_command_id);

}  // namespace corbot
