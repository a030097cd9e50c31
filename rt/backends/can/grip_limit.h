// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <optional>

namespace corbot::rt {

/// Limits the target of a gripper's drive, in counts: it never leads the shaft by more than a small amount.
/// So fingers that close on something stay there, and the drive has no following error. Their force follows
/// from the drive's position loop and its own limits of torque. Pure.
class GripLimit {
 public:
  /// The greatest lead, as a share of the travel from closed to open. A shaft that follows at full speed lags
  /// by less, except for its motion until its position is known.
  static constexpr double kLead = 0.05;
  static constexpr double kPeriodsLate = 2.0;
  /// The catch-up speed in multiples of the gripper's mean speed. When an obstacle is gone the target goes on
  /// to the commanded one no faster; no planned motion is faster.
  static constexpr double kCatchUp = 2.0;

  GripLimit(double travel_counts, double travel_s) : travel_(std::abs(travel_counts)), travel_s_(travel_s) {}

  /// Sets 6065h, by which the drive goes into fault on its own: half of it is not exceeded. Empty, or all
  /// ones: there is none.
  void set_following_window(std::optional<std::uint32_t> counts) {
    constexpr std::uint32_t kNone = 0xFFFF'FFFF;
    most_ = counts && *counts != kNone ? 0.5 * static_cast<double>(*counts) : travel_;
  }

  /// `position`: of the shaft; `last`: the previous target, `period_s` ago.
  [[nodiscard]] std::int32_t target(std::int32_t wanted, std::int32_t position, std::int32_t last,
                                    double period_s) const {
    const double step = std::max(kCatchUp * travel_ / travel_s_ * period_s, 1.0);
    const double lead = std::max(std::min(kLead * travel_ + kPeriodsLate * step, most_), 1.0);
    const double near = std::clamp<double>(wanted, position - lead, position + lead);
    return static_cast<std::int32_t>(std::lround(std::clamp<double>(near, last - step, last + step)));
  }

 private:
  double travel_;
  double travel_s_;
  double most_{travel_};
};

}  // namespace corbot::rt
