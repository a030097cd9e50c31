// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "corbot/arm/arm_model.h"
#include "corbot/channel/records.h"
#include "corbot/motion/bounds.h"
#include "corbot/motion/command.h"

namespace corbot::rt {

/// Numbers of commands rise by one; a greater jump is corrupt data.
inline constexpr std::uint64_t kLargestIdStep = 1'000'000;

/// The arm's state of rest when a command comes.
struct RestState {
  std::uint64_t last_id{};  ///< number of the previous command
  Joints position_q{};
  double opening{};
};

/// The result: kDone means that the command may run. Otherwise the verdict, and the offending field.
struct CommandVerdict {
  Verdict verdict{Verdict::kDone};
  std::int32_t joint{-1};
  double value{};  ///< the offending value; its unit depends on the field
  [[nodiscard]] bool ok() const noexcept { return verdict == Verdict::kDone; }
};

/// Checks every field of a command from shared memory, which a network-facing process writes. A command that
/// passes can be evaluated at any virtual time. It begins at the arm's rest position, ends in range and keeps
/// the arm's limits by its laws. RateCheck checks the knots and pieces of a line or an arc. The caller checks
/// the epoch. Real-time safe.
[[nodiscard]] CommandVerdict check_command(const ArmModel& arm, const Command& command,
                                           const RestState& rest) noexcept;

}  // namespace corbot::rt
