// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <span>
#include <string>
#include <vector>

#include "client/request.h"
#include "config/profile.h"
#include "planner/planner.h"

namespace corbot::cli {

/// Reads a profile. Throws Failure, kUsage, with the fault's text.
[[nodiscard]] Profile profile_of(const std::string& file);

/// Plans commands one after the other like the servant, without any process. The arm begins with all joints
/// at 0 or at begin_at(), with the profile's settings.
class DryRun {
 public:
  /// Throws Failure if the profile cannot be read.
  explicit DryRun(const std::string& profile);
  explicit DryRun(Profile profile);

  /// Sets the start, before the first command, in shown units, one for each joint. Throws Failure for a wrong
  /// number of values.
  void begin_at(std::span<const double> joints);
  /// Describes the start of the first command for a person.
  [[nodiscard]] const std::string& begins() const noexcept { return begins_; }

  [[nodiscard]] const std::string& robot() const noexcept { return profile_.name; }
  [[nodiscard]] const Profile& profile() const noexcept { return profile_; }
  /// Returns the plans of the accepted motions, in order.
  [[nodiscard]] const std::vector<PlanResult>& plans() const noexcept { return plans_; }
  /// Returns why the robot would refuse the command. Returns nothing if the dry run has carried it out or has
  /// stored its setting.
  [[nodiscard]] std::optional<std::string> refusal_of(const client::Request& given);
  /// Returns the plan of the last command, see plan_text(). Empty if it was refused or is no motion.
  [[nodiscard]] std::string plan() const;

 private:
  std::optional<std::string> move(const client::Request& request);
  std::optional<std::string> set(const client::Request& request);
  std::optional<std::string> set_speed(const client::Request& request);
  std::optional<std::string> set_orientation(const client::Request& request);
  std::optional<std::string> set_limit(const client::Request& request);
  std::optional<std::string> set_frame(const client::Request& request);

  Profile profile_;
  Planner planner_;
  PlanSettings settings_;
  PlanStart start_;
  std::string begins_{"all joints at 0"};
  std::vector<PlanResult> plans_;
  PlanResult plan_;      ///< of the last command; empty if it has no plan
  client::Verb verb_{};  ///< of the last command
};

}  // namespace corbot::cli
