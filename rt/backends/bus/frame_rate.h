// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>

namespace corbot::rt {

/// How many frames a second a device really takes, against what it announced, by the time that each one has kept it
/// busy. A device that falls behind for a second or longer has the arm slowed by the same share, so that from one frame to
/// the next the path is no longer than it was announced; it gains speed again by steps, when it has been faster for a
/// while. Single frames that took long, as when the machine stood still, do not count. Pure.
class FrameRate {
 public:
  static constexpr double kLeastRatio = 0.05;

  /// A device that announces a frame every `period_ns`.
  void begin(std::int64_t period_ns) noexcept;
  /// A frame has kept the device busy so long. True when the rate is known anew, about once a second.
  bool count(std::int64_t busy_ns) noexcept;
  [[nodiscard]] double announced_hz() const noexcept { return 1e9 / static_cast<double>(period_ns_); }
  [[nodiscard]] double reached_hz() const noexcept { return reached_hz_; }
  /// The share of the planned speed that the device can follow.
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
