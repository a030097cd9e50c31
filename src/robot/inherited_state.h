// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>

#include "corbot/channel/servant_state.h"
#include "planner/plan.h"

namespace corbot {

/// What the servant before this one has left, as far as it is valid.
struct InheritedState {
  std::optional<PlanSettings> settings;
  int invalid{0};  ///< records that no servant of this robot writes: each was left out
};

/// Reads what another process wrote. Every record is copied once and each of its fields checked; one that is torn
/// or invalid costs none of the others. Never fails.
[[nodiscard]] InheritedState read_inherited(const ServantState& former);

}  // namespace corbot
