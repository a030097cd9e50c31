// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>

namespace corbot::rt {

/// Measures a device's real frame rate against the announced one, by the busy time of each frame. If the
/// device falls behind for a second or longer, the arm is slowed by the same share. The path between two
/// frames is then no longer than announced. The arm gains speed again by steps, after the device has been
/// faster for a while. Single slow frames, as after a standstill of the machine, do not count. Pure.
class FrameRate {
 public:
  static constexpr double kLeastRatio = 0.05;

  /// Starts with a device that announces a frame every `period_ns`.
  void begin(std::int64_t period_ns) noexcept;
  /// Counts a frame's busy time. Returns true when there is a new rate, about once a second.
  bool count(std::int64_t busy_ns) noexcept;
  [[nodiscard]] double announced_hz() const noexcept { return 1e9 / static_cast<double>(period_ns_); }
  [[nodiscard]] double reached_hz() const noexcept { return reached_hz_; }
  /// Returns the share of the planned speed that the device can follow.
  [[nodiscard]] double speed_ratio() const noexcept { return speed_ratio_; }
  [[nodiscard]] bool is_slow() const noexcept { return speed_ratio_ < 1.0; }

 private:
  void judge(double share) noexcept;

  std::int64_t period_ns_{20'000'000};
  std::int64_t sum_ns_{0};
  std::int64_t frames_{0};
  std::array<std::int64_t, 2> longest_ns_{};  ///< the longer one first
  double reached_hz_{0.0};
  double speed_ratio_{1.0};
};

}  // namespace corbot::rt
