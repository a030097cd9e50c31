// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>

#include "corbot/kinematics/joints.h"
#include "rt/cycle/law_segments.h"

namespace corbot::rt {

/// One law that the governor keeps within bounds: q(s) runs by virtual time s, and its limits are those of q
/// by real time.
struct GovernedLaw {
  LawSegments law;
  double acceleration_limit{};
  double jerk_limit{};
};

/// The laws of a running motion: one for each joint, one for the gripper, none for a dwell or a path. The
/// governor's guarantees hold for laws of equal duration, which check_law() (command_check.cpp) requires of
/// all moving laws.
struct GovernedMotion {
  std::array<GovernedLaw, kMaxJoints> laws;
  std::size_t count{0};
  double duration_s{0.0};      ///< in virtual time
  double longest_ramp_s{0.0};  ///< of a change to another rate than 0, see longest_ramp_s()
};

/// A plan may touch its limits exactly, and then differs by rounding.
inline constexpr double kLimitTolerance = 2e-6;

/// The virtual time of a motion and its rate, by real time.
struct RateState {
  double time_s{0.0};  ///< virtual
  double rate{0.0};
  double change{0.0};  ///< of the rate
};

}  // namespace corbot::rt
