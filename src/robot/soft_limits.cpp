// SPDX-License-Identifier: Apache-2.0
#include "robot/soft_limits.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <system_error>
#include <utility>
#include <variant>

#include "corbot/arm/joint_units.h"
#include "robot/call_error.h"

namespace corbot {
namespace {

/// Of the units that are shown and back.
constexpr double kRounding_q = 1e-9;

/// "-0.15 to 0 m".
std::string shown_range(JointKind kind, double lower_q, double upper_q) {
  return fmt::format("{:.6g} to {:.6g} {}", tidy_shown(kind, lower_q), tidy_shown(kind, upper_q),
                     unit_name(kind));
}

CallError outside(const Kinematics& arm, const std::string& parameter, std::size_t joint, double value_q,
                  double lower_q, double upper_q, const std::string& text) {
  PlanRefusal refusal(PlanRefusal::Kind::kLimitExceeded, parameter, Quantity::kJointValue);
  refusal.joint = static_cast<int>(joint);
  refusal.value = value_q;
  refusal.lower = lower_q;
  refusal.upper = upper_q;
  refusal.text = text;
  return refused(refusal, arm);
}

}  // namespace

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
  if (limits_) return limits_;
  JointRanges all;
  for (std::size_t i = 0; i < arm_.dof; ++i) {
    all.lower_q[i] = arm_.joints[i].lower_q;
    all.upper_q[i] = arm_.joints[i].upper_q;
  }
  return all;
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

JointRanges SoftLimits::checked(const JointRanges& wanted) const {
  JointRanges limits;
  for (std::size_t i = 0; i < arm_.dof; ++i) {
    const double lower = wanted.lower_q[i];
    const double upper = wanted.upper_q[i];
    const JointLimits& range = arm_.joints[i];
    const JointKind kind = arm_.kinematics.joint_kind(i);
    const char* const unit = unit_name(kind);
    for (const double value : {lower, upper}) {
      if (!std::isfinite(value))
        throw bad_argument("limits", value, fmt::format("a limit of joint {} is not a finite number", i));
    }
    if (lower > upper) {
      throw bad_argument("limits", lower,
                         fmt::format("joint {}: the lower limit {:.6g} {} is above the upper one, {:.6g} {}",
                                     i, lower, unit, upper, unit));
    }
    for (const double value : {lower, upper}) {
      const double value_q = from_shown(kind, value);
      if (value_q >= range.lower_q - kRounding_q && value_q <= range.upper_q + kRounding_q) continue;
      throw outside(arm_.kinematics, "joint range", i, value_q, range.lower_q, range.upper_q,
                    fmt::format("joint {}: the limit {:.6g} {} is outside the range of the profile, {}", i,
                                value, unit, shown_range(kind, range.lower_q, range.upper_q)));
    }
    limits.lower_q[i] = std::clamp(from_shown(kind, lower), range.lower_q, range.upper_q);
    limits.upper_q[i] = std::clamp(from_shown(kind, upper), range.lower_q, range.upper_q);
  }
  return limits;
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
    // Where they were not known they stay so, and a restart finds the ones that were wanted.
    if (was_known) save(before);
    throw;
  }
}

void SoftLimits::take(const std::optional<JointRanges>& wanted) {
  const std::lock_guard lock(mutex_);
  limits_ = wanted;
  unknown_.clear();
}

void check_stands_within(const JointRanges& limits, const Joints& position_q, const ArmModel& arm) {
  for (std::size_t i = 0; i < arm.dof; ++i) {
    if (position_q[i] >= limits.lower_q[i] - kRounding_q && position_q[i] <= limits.upper_q[i] + kRounding_q)
      continue;
    const JointKind kind = arm.kinematics.joint_kind(i);
    throw outside(arm.kinematics, "joint position", i, position_q[i], limits.lower_q[i], limits.upper_q[i],
                  fmt::format("joint {} stands at {:.6g} {}, outside the wanted limits, {}", i,
                              to_shown(kind, position_q[i]), unit_name(kind),
                              shown_range(kind, limits.lower_q[i], limits.upper_q[i])));
  }
}

}  // namespace corbot
