// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <mutex>
#include <optional>
#include <string>

#include "corbot/arm/arm_model.h"
#include "planner/request.h"
#include "state/soft_limits_store.h"

namespace corbot {

/// The ranges that planned motions keep, and their copy on disk, which outlives servant, task and power-down. Where that
/// copy cannot be read nobody knows what they were, and no joint moves until they are set or reset. Thread-safe.
class SoftLimits {
 public:
  explicit SoftLimits(const ArmModel& arm) : arm_(arm) {}

  /// Before calls are served. Returns what is wrong with the copy; "": nothing.
  [[nodiscard]] std::string keep_in(SoftLimitsStore store);
  /// The ranges in force, the profile's where none are set; nothing: not known.
  [[nodiscard]] std::optional<JointRanges> ranges() const;
  /// Those of PlanSettings: nothing where none are set, or they are not known.
  [[nodiscard]] std::optional<JointRanges> wanted() const;
  /// Throws CallError (not ready) where they are not known and the request moves joints.
  void check_known(const MotionRequest& request) const;

  /// Saves them, and then lets `apply` run, which calls take() or throws; what was saved is put back then. Nothing: those of
  /// the profile. Throws CallError (not ready) where they cannot be saved.
  void change(const std::optional<JointRanges>& wanted, const std::function<void()>& apply);
  /// In force from now on.
  void take(const std::optional<JointRanges>& wanted);

 private:
  const ArmModel& arm_;
  std::mutex change_mutex_;   // one change at a time; taken before the other
  mutable std::mutex mutex_;  // of the members below
  std::optional<SoftLimitsStore> store_;
  std::optional<JointRanges> limits_;
  std::string unknown_;  ///< why they are not known; "": they are
};

}  // namespace corbot
