// SPDX-License-Identifier: Apache-2.0
#include "robot/soft_limits.h"

#include <fmt/format.h>

#include <system_error>
#include <utility>
#include <variant>

#include "planner/setting_rules.h"
#include "robot/call_error.h"

namespace corbot {

std::string SoftLimits::keep_in(SoftLimitsStore store) {
  const std::lock_guard lock(mutex_);
  try {
    limits_ = store.load(arm_);
  } catch (const SoftLimitsError& error) {
    unknown_ = error.what();
  }
  store_ = std::move(store);
  return unknown_;
}

std::optional<JointRanges> SoftLimits::ranges() const {
  const std::lock_guard lock(mutex_);
  if (!unknown_.empty()) return std::nullopt;
  return limits_ ? *limits_ : profile_ranges(arm_);
}

std::optional<JointRanges> SoftLimits::wanted() const {
  const std::lock_guard lock(mutex_);
  return unknown_.empty() ? limits_ : std::nullopt;
}

void SoftLimits::check_known(const MotionRequest& request) const {
  if (std::holds_alternative<DwellRequest>(request) || std::holds_alternative<GripperRequest>(request))
    return;
  const std::lock_guard lock(mutex_);
  if (unknown_.empty()) return;
  throw not_ready(fmt::format("the soft limits are not known: set or reset them ({})", unknown_));
}

void SoftLimits::change(const std::optional<JointRanges>& wanted, const std::function<void()>& apply) {
  const std::lock_guard one(change_mutex_);
  const auto save = [&](const std::optional<JointRanges>& limits) {
    std::optional<SoftLimitsStore> store;
    {
      const std::lock_guard lock(mutex_);
      store = store_;
    }
    if (!store) throw not_ready("the soft limits cannot be saved: the servant has no state directory");
    try {
      store->save(limits, arm_);
    } catch (const std::system_error& error) {
      throw not_ready(fmt::format("the soft limits cannot be saved: {}", error.what()));
    }
  };
  const bool was_known = ranges().has_value();
  const std::optional<JointRanges> before = this->wanted();
  save(wanted);
  try {
    apply();
  } catch (const CallError&) {
    // Unknown ranges stay unknown; a restart then finds the ranges that were requested.
    if (was_known) save(before);
    throw;
  }
}

void SoftLimits::take(const std::optional<JointRanges>& wanted) {
  const std::lock_guard lock(mutex_);
  limits_ = wanted;
  unknown_.clear();
}

}  // namespace corbot
