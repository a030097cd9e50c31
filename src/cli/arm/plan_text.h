// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <arm.hh>
#include <string>
#include <vector>

#include "client/request.h"
#include "planner/reasons.h"

namespace corbot::cli {

/// The parts of a plan that a robot has made.
[[nodiscard]] std::vector<rate::PlanPart> parts_of(const Corbot::PlanInfo& plan);

/// One or two lines for each part of a plan: its time, the limits that it meets, and a singularity that is near.
/// `verb` asked for it, with a time or a speed where no limit is met.
[[nodiscard]] std::string plan_text(const std::vector<rate::PlanPart>& parts, client::Verb verb);

}  // namespace corbot::cli
