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

/// What the servant before this one has left, as far as it is valid.
struct InheritedState {
  std::optional<PlanSettings> settings;
  std::vector<AlarmEntry> alarms;  ///< oldest first
  std::vector<Ticket> tickets;     ///< in the order of their numbers
  std::optional<ControlRecord> control;
  std::string held_by;  ///< who asked for the last StopAndHold; empty: not known
  int invalid{0};       ///< records that no servant of this robot writes: each was left out
};

/// Reads what another process wrote. Every record is copied once and each of its fields checked; one that is torn
/// or invalid costs none of the others. `next_command_id`: of the new servant, beyond all numbers that can be right.
[[nodiscard]] InheritedState read_inherited(const ServantSegment& former, const ArmModel& arm,
                                            std::uint64_t next_command_id);

}  // namespace corbot
