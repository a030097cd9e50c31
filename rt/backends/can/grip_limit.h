// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <optional>

namespace corbot::rt {

/// The target of a gripper's drive, in counts: never further from the shaft than a small lead. Fingers that close on
/// something stay there, press by what the drive's position loop and its own limits of torque make of that lead, and the
/// drive has no following error. Pure.
class GripLimit {
 public:
  /// Of the travel from closed to open. A shaft that follows at full speed is behind by less, but for what it moves
  /// until its position is known.
  static constexpr double kLead = 0.05;
  static constexpr double kPeriodsLate = 2.0;
  /// When what was in the way is gone the target goes on to what was commanded no faster than that many times the
  /// gripper's mean speed; no planned motion is faster.
  static constexpr double kCatchUp = 2.0;

  GripLimit(double travel_counts, double travel_s) : travel_(std::abs(travel_counts)), travel_s_(travel_s) {}

  /// 6065h, by which the drive goes into fault on its own: half of it is not exceeded. Nothing, or all ones: it has none.
  void set_following_window(std::optional<std::uint32_t> counts) {
    constexpr std::uint32_t kNone = 0xFFFF'FFFF;
    most_ = counts && *counts != kNone ? 0.5 * static_cast<double>(*counts) : travel_;
  }

  /// `position`: of the shaft; `last`: the target before, `period_s` ago.
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
