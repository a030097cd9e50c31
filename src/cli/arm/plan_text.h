// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <arm.hh>
#include <string>
#include <vector>

#include "planner/reasons.h"

namespace corbot::cli {

/// The parts of a plan that a robot has made.
[[nodiscard]] std::vector<rate::PlanPart> parts_of(const Corbot::PlanInfo& plan);

/// One or two lines for each part of a plan: its time, the limits that it meets, and a singularity that is near.
[[nodiscard]] std::string plan_text(const std::vector<rate::PlanPart>& parts);

}  // namespace corbot::cli
