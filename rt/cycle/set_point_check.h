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

/// Tolerance of the range check: more than the planner's own, or a motion that it has proved would end here.
inline constexpr double kGateTolerance_q = 2.0 * kRangeTolerance_q;

/// What is wrong with a set-point; `ok` when nothing is.
struct SetPointVerdict {
  bool ok{true};
  AlarmEvent alarm{};
};

/// The last gate before the servos: whatever was planned, evaluated or computed, no set-point passes that is
/// not finite, leaves a joint's range, or is farther from the last one than the joint's speed allows in
/// `dt_s`. The gripper's opening must lie in [0, 1]. Real-time safe.
[[nodiscard]] SetPointVerdict check_set_point(const ArmModel& arm, const Joints& last_q, const Joints& next_q,
                                              double opening, double dt_s) noexcept;

/// Speed, acceleration and jerk of every joint along a path whose rate keeps their limits at every instant: differences of set-points,
/// which are means of derivatives and so never exceed their peaks. Real-time safe.
class DifferenceCheck {
 public:
  static constexpr double kAllowed = 1.01;  ///< of each limit

  /// At rest, when a motion begins, and where the set-point was held in between.
  void begin(const Joints& rest_q) noexcept { last_q_.fill(rest_q); }
  /// The next set-point, a period after the last. One that is refused is not taken.
  [[nodiscard]] SetPointVerdict see(const ArmModel& arm, const Joints& next_q, double period_s) noexcept;

 private:
  std::array<Joints, 3> last_q_{};  ///< the newest first
};

/// Finite and in range; for a position that comes from outside and has no predecessor. Real-time safe.
[[nodiscard]] bool is_in_range(const ArmModel& arm, const Joints& position_q, double tolerance_q) noexcept;

/// The first joint that a device has outside its range by more than near_q() of `near_rad`, or nowhere; nothing: there is none.
/// From there every set-point would be a motion that nobody asked for. Real-time safe.
[[nodiscard]] std::optional<alarm::OutOfRange> beyond_range(const ArmModel& arm, const Joints& position_q,
                                                            double near_rad) noexcept;

}  // namespace corbot::rt
