// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <arm.hh>
#include <string>
#include <vector>

#include "client/request.h"
#include "planner/reasons.h"

namespace corbot::cli {

/// Converts the parts of a plan that a robot has made.
[[nodiscard]] std::vector<rate::PlanPart> parts_of(const Corbot::PlanInfo& plan);

/// Returns one or two lines for each part of a plan: its time, the limits that it reaches, and a nearby
/// singularity. If it reaches no limit, `verb` says whether a time or a speed was requested.
[[nodiscard]] std::string plan_text(const std::vector<rate::PlanPart>& parts, client::Verb verb);

}  // namespace corbot::cli
