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

/// The ranges that planned motions keep, and their copy on disk, which outlives servant, task and power-down.
/// If the copy cannot be read, the ranges are unknown, and no joint moves until they are set or reset.
/// Thread-safe.
class SoftLimits {
 public:
  explicit SoftLimits(const ArmModel& arm) : arm_(arm) {}

  /// Reads the copy, before calls are served. Returns what is wrong with the copy, or "".
  [[nodiscard]] std::string keep_in(SoftLimitsStore store);
  /// Returns the ranges in force, the profile's if none are set, or nothing if they are not known.
  [[nodiscard]] std::optional<JointRanges> ranges() const;
  /// Returns the value for PlanSettings: nothing if no ranges are set, or they are not known.
  [[nodiscard]] std::optional<JointRanges> wanted() const;
  /// Throws CallError (not ready) if the ranges are not known and the request moves joints.
  void check_known(const MotionRequest& request) const;

  /// Saves the ranges and then runs `apply`, which calls take() or throws. If `apply` throws, restores the
  /// saved ranges. `wanted` empty: the profile's ranges. Throws CallError (not ready) if the ranges cannot be
  /// saved.
  void change(const std::optional<JointRanges>& wanted, const std::function<void()>& apply);
  /// Puts the ranges in force.
  void take(const std::optional<JointRanges>& wanted);

 private:
  const ArmModel& arm_;
  std::mutex change_mutex_;   // one change at a time; locked before mutex_
  mutable std::mutex mutex_;  // guards the members below
  std::optional<SoftLimitsStore> store_;
  std::optional<JointRanges> limits_;
  std::string unknown_;  ///< why the ranges are not known; "": they are known
};

}  // namespace corbot
