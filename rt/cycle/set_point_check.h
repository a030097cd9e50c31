// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <optional>

#include "corbot/arm/arm_model.h"
#include "corbot/arm/near_range.h"
#include "corbot/channel/alarms.h"
#include "corbot/channel/records.h"
#include "corbot/motion/bounds.h"

namespace corbot::rt {

/// Tolerance of the range check. It exceeds the planner's own, or a motion that the planner has proved would
/// end here.
inline constexpr double kGateTolerance_q = 2.0 * kRangeTolerance_q;

/// The fault of a set-point; `ok` if there is none.
struct SetPointVerdict {
  bool ok{true};
  AlarmEvent alarm{};
};

/// The last gate before the servos. It refuses every set-point that is not finite or leaves a joint's range.
/// It also refuses one that is farther from the last than the joint's speed allows in `dt_s`. The gripper's
/// opening must lie in [0, 1]. Real-time safe.
[[nodiscard]] SetPointVerdict check_set_point(const ArmModel& arm, const Joints& last_q, const Joints& next_q,
                                              double opening, double dt_s) noexcept;

/// Checks speed, acceleration and jerk of every joint along a path whose rate keeps their limits at every
/// instant. It uses differences of set-points, which are means of derivatives and so never exceed their
/// peaks. Real-time safe.
class DifferenceCheck {
 public:
  static constexpr double kAllowed = 1.01;  ///< share of each limit

  /// Begins at rest: when a motion begins, and if the set-point was held in between.
  void begin(const Joints& rest_q) noexcept { last_q_.fill(rest_q); }
  /// Checks the next set-point, a period after the last. A refused one is not taken.
  [[nodiscard]] SetPointVerdict see(const ArmModel& arm, const Joints& next_q, double period_s) noexcept;

 private:
  std::array<Joints, 3> last_q_{};  ///< the newest first
};

/// Tells whether a position from outside, without predecessor, is finite and in range. Real-time safe.
[[nodiscard]] bool is_in_range(const ArmModel& arm, const Joints& position_q, double tolerance_q) noexcept;

/// Returns the first joint that a device reports outside its range by more than near_q() of `near_rad`, or
/// without a number; empty: none. From there every set-point would be an uncommanded motion. Real-time safe.
[[nodiscard]] std::optional<alarm::OutOfRange> beyond_range(const ArmModel& arm, const Joints& position_q,
                                                            double near_rad) noexcept;

}  // namespace corbot::rt
