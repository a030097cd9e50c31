// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cmath>
#include <cstddef>

#include "corbot/motion/time_law.h"

namespace corbot::rt {

/// The seven segments of a time law, unrolled once. The governor can then read derivatives along a ramp at
/// the cost of a few multiplications for each sample. Velocity, acceleration and jerk are by virtual time, in
/// the unit of the law.
class LawSegments {
 public:
  static constexpr std::size_t kCount = 7;

  LawSegments() = default;
  /// Takes a well formed law; a zero distance gives zero throughout. Real-time safe.
  explicit LawSegments(const TimeLaw& law) noexcept;

  [[nodiscard]] double duration_s() const noexcept { return begin_s_[kCount]; }
  /// Returns the segment at a virtual time, sought onwards from `hint`. Times at and beyond the end belong to
  /// the last one.
  [[nodiscard]] std::size_t segment_at(double time_s, std::size_t hint) const noexcept {
    while (hint + 1 < kCount && time_s >= begin_s_[hint + 1]) ++hint;
    return hint;
  }
  [[nodiscard]] double velocity(std::size_t segment, double time_s) const noexcept {
    const double t_s = clamped(segment, time_s);
    return velocity_[segment] + t_s * (acceleration_[segment] + t_s * jerk_[segment] / 2.0);
  }
  [[nodiscard]] double acceleration(std::size_t segment, double time_s) const noexcept {
    return acceleration_[segment] + clamped(segment, time_s) * jerk_[segment];
  }
  /// Returns the acceleration at the segment's beginning; it is linear in between.
  [[nodiscard]] double acceleration_at_begin(std::size_t segment) const noexcept {
    return acceleration_[segment];
  }
  [[nodiscard]] double jerk(std::size_t segment) const noexcept { return jerk_[segment]; }
  /// Returns the magnitude, like all positions here.
  [[nodiscard]] double position(std::size_t segment, double time_s) const noexcept {
    return position_in(segment, clamped(segment, time_s));
  }
  [[nodiscard]] double distance() const noexcept { return position_[kCount]; }
  [[nodiscard]] double begin_s(std::size_t segment) const noexcept { return begin_s_[segment]; }
  /// Returns +1 or -1, the sign of velocity, acceleration and jerk.
  [[nodiscard]] double sign() const noexcept { return jerk_[0] < 0.0 ? -1.0 : 1.0; }
  /// Returns the virtual time at which the law has this position, sought onwards from `segment`, and sets
  /// `segment`. Bounded.
  [[nodiscard]] double time_at(double position, std::size_t* segment) const noexcept;

 private:
  [[nodiscard]] double clamped(std::size_t segment, double time_s) const noexcept {
    const double length_s = begin_s_[segment + 1] - begin_s_[segment];
    const double t_s = time_s - begin_s_[segment];
    return t_s < length_s ? t_s : length_s;
  }

  [[nodiscard]] double position_in(std::size_t segment, double t_s) const noexcept {
    const double travelled =
        t_s * (velocity_[segment] + t_s * (acceleration_[segment] / 2.0 + t_s * jerk_[segment] / 6.0));
    return position_[segment] + std::abs(travelled);
  }

  std::array<double, kCount + 1> begin_s_{};
  std::array<double, kCount + 1> position_{};
  std::array<double, kCount> velocity_{};
  std::array<double, kCount> acceleration_{};
  std::array<double, kCount> jerk_{};
};

}  // namespace corbot::rt
