// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cmath>
#include <cstddef>

namespace corbot::rt {

/// Returns the velocity that is left when the acceleration has gone to 0.
[[nodiscard]] inline double when_even(double velocity, double acceleration, double jerk) noexcept {
  return velocity + acceleration * std::abs(acceleration) / (2.0 * jerk);
}

/// Brings the velocity of a joint, or of a law of a path, to rest as fast as its limits allow. It has three
/// segments of constant jerk. Acceleration and jerk keep their limits if the acceleration at the beginning
/// does. Real-time safe, in closed form.
class StopLaw {
 public:
  static constexpr std::size_t kSegments = 3;

  StopLaw() = default;
  StopLaw(double velocity, double acceleration, double acceleration_limit, double jerk_limit) noexcept;

  [[nodiscard]] double velocity(double time_s) const noexcept;
  [[nodiscard]] double acceleration(double time_s) const noexcept;
  [[nodiscard]] double way(double time_s) const noexcept;  ///< signed: the distance travelled by then
  [[nodiscard]] double duration_s() const noexcept { return falls_s_ + holds_s_ + rises_s_; }
  [[nodiscard]] double jerk(std::size_t segment) const noexcept {
    return sign_ * jerk_ * (static_cast<double>(segment) - 1.0);
  }
  [[nodiscard]] double segment_s(std::size_t segment) const noexcept {
    return std::array<double, kSegments>{falls_s_, holds_s_, rises_s_}[segment];
  }
  /// Returns the signed distance from the beginning to rest, in steps of a period that each have the velocity
  /// at their end.
  [[nodiscard]] double distance(double period_s) const noexcept;

 private:
  double sign_{1.0};
  double velocity_{0.0};      ///< at the beginning, times sign_
  double acceleration_{0.0};  ///< at the beginning, times sign_
  double peak_{0.0};          ///< magnitude of the deceleration
  double jerk_{1.0};
  double falls_s_{0.0};  ///< from acceleration_ to -peak_
  double holds_s_{0.0};
  double rises_s_{0.0};  ///< from -peak_ to 0
  double way_{0.0};      ///< to rest, times sign_
};

}  // namespace corbot::rt
