// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "corbot/arm/arm_model.h"
#include "planner/plan/plan.h"

namespace corbot::cli {

/// One or two lines for each command of a plan: its time, the limits that it meets, and a singularity that is near. Empty for a refusal.
[[nodiscard]] std::string plan_text(const ArmModel& model, const PlanSettings& settings,
                                    const PlanResult& plan);

}  // namespace corbot::cli
