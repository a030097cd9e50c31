// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>

#include "corbot/arm/arm_model.h"
#include "corbot/motion/path_knots.h"
#include "rt/cycle/command_check.h"

namespace corbot::rt {

/// Whether the knots that came with a line or an arc say what it says: the tool on its path at every knot, with its velocity, and at two
/// points between knots; that leaves a polynomial of the fifth degree no room for anything else. Joints within their ranges, from where
/// the arm rests to where the command ends. A few pieces a call, so that a cycle's time is bounded: nothing moves before all of them have passed.
class KnotCheck {
 public:
  static constexpr std::size_t kPieces = 4;  ///< of one call
  /// What planner and this compute differently is far less.
  static constexpr double kTracking = 2e-6;  ///< m and rad

  /// `command` has passed check_command(); `knots`: its own, the same in all calls. Nothing: call again. Real-time safe.
  [[nodiscard]] std::optional<CommandVerdict> step(const ArmModel& arm, const Command& command,
                                                   PathKnots knots) noexcept;

 private:
  std::uint64_t id_{0};  ///< of the command that is being looked at
  std::size_t next_{0};  ///< piece
};

}  // namespace corbot::rt
