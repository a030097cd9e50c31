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

/// Plans one command after the other as the servant does, without any process. The arm begins with all joints at 0 or where begin_at() says,
/// with the profile's settings.
class DryRun {
 public:
  /// Throws Failure where the profile cannot be read.
  explicit DryRun(const std::string& profile);
  explicit DryRun(Profile profile);

  /// Before the first command. Shown units, one for each joint; throws Failure where there are more or fewer.
  void begin_at(std::span<const double> joints);
  /// Where the first command begins, for people.
  [[nodiscard]] const std::string& begins() const noexcept { return begins_; }

  [[nodiscard]] const std::string& robot() const noexcept { return profile_.name; }
  [[nodiscard]] const Profile& profile() const noexcept { return profile_; }
  /// Of the motions that are carried out, in their order.
  [[nodiscard]] const std::vector<PlanResult>& plans() const noexcept { return plans_; }
  /// Why the robot would refuse the command. Nothing: it is carried out, or set for those that follow.
  [[nodiscard]] std::optional<std::string> refusal_of(const client::Request& given);
  /// Of the last command, see plan_text(). Empty: it was refused, or is no motion.
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
  PlanResult plan_;      ///< of the last command; no commands where there is none
  client::Verb verb_{};  ///< of the last command
};

}  // namespace corbot::cli
