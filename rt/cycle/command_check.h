// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "corbot/arm/arm_model.h"
#include "corbot/channel/records.h"
#include "corbot/motion/bounds.h"
#include "corbot/motion/command.h"

namespace corbot::rt {

/// Numbers of commands rise by one; a greater jump is corrupt data.
inline constexpr std::uint64_t kLargestIdStep = 1'000'000;

/// Where the arm is at rest when a command comes.
struct RestState {
  std::uint64_t last_id{};  ///< of the command before
  Joints position_q{};
  double opening{};
};

/// kDone: the command may run. Otherwise the verdict, and what was wrong.
struct CommandVerdict {
  Verdict verdict{Verdict::kDone};
  std::int32_t joint{-1};
  double value{};  ///< the offending value; its unit follows the field
  [[nodiscard]] bool ok() const noexcept { return verdict == Verdict::kDone; }
};

/// Checks every field of a command that came out of shared memory, where a network-facing process writes: a
/// command that passes can be evaluated at any virtual time, begins where the arm rests, ends in range and
/// keeps the limits of the arm by its laws. Knots and pieces of a line or an arc are left to RateCheck. The
/// caller checks the epoch. Real-time safe.
[[nodiscard]] CommandVerdict check_command(const ArmModel& arm, const Command& command,
                                           const RestState& rest) noexcept;

}  // namespace corbot::rt
