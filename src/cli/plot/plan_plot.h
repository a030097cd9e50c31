// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <string>
#include <vector>

#include "cli/arm/dry_run.h"
#include "cli/plot/recording.h"
#include "corbot/kinematics/pose.h"

namespace corbot::cli::charts {

/// Planned motions one after the other, each at full rate, as a task with a period of 1 ms would carry them
/// out.
struct PlanSamples {
  Recording motion;
  std::vector<Vector3> points_m;  ///< positions of the tool centre point, in the profile's frames

  /// Returns the series of the rate of lambda. Only a line or an arc whose time is planned as a rate has one.
  [[nodiscard]] std::size_t rate() const noexcept { return motion.gripper_pulse() + 1; }
};

[[nodiscard]] PlanSamples sample(const Profile& profile, std::span<const PlanResult> plans);

/// Draws the plans of a dry run. Throws Failure, kUsage if nothing moves.
void plot_plan(const DryRun& robot, const std::string& name, const std::string& file);

}  // namespace corbot::cli::charts
