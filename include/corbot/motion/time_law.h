// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <type_traits>

namespace corbot {

/// A rest-to-rest, jerk-limited, symmetric seven-segment law. The jerk is +j, 0, −j, 0, −j, 0, +j for t_jerk,
/// t_acc, t_jerk, t_cruise, t_jerk, t_acc, t_jerk seconds. It follows from the distance, so no two fields can
/// contradict each other:
///     distance = j · t_jerk · (t_jerk + t_acc) · (2 t_jerk + t_acc + t_cruise).
/// The caller chooses the unit of `distance` (rad or m, or 1 for a path parameter that runs from 0 to 1).
struct TimeLaw {
  double distance{};    ///< signed
  double t_jerk_s{};    ///< each of the four jerk segments, ≥ 0
  double t_acc_s{};     ///< each of the two constant-acceleration segments, ≥ 0
  double t_cruise_s{};  ///< ≥ 0

  [[nodiscard]] constexpr double duration_s() const noexcept {
    return 4.0 * t_jerk_s + 2.0 * t_acc_s + t_cruise_s;
  }
};
static_assert(std::is_trivially_copyable_v<TimeLaw>);

/// Position and its first three derivatives with respect to (virtual) time.
struct LawState {
  double position{};
  double velocity{};
  double acceleration{};
  double jerk{};
};

}  // namespace corbot
