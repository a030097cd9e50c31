// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string>

#include "corbot/arm/arm_model.h"

namespace corbot::soak {

/// The highest demands of one motion on the arm, by difference quotients of the recorded set-points.
struct Peaks {
  struct Of {
    double value{};  ///< of joints a share of the limit, of the tool in metres and seconds
    std::uint64_t cycle{};
    std::size_t joint{};
  };
  Of joint_acceleration;
  Of joint_jerk;
  Of tool_speed;
  Of tool_acceleration;
  Of tool_jerk;
  std::array<double, 4> up_deg{};  ///< the longest step of each joint upwards
  std::array<double, 4> down_deg{};
};

/// How far a peak may be beyond its limit. The governor judges a ramp by samples, see the property tests
/// (1e-4). The rest is the recording's: angles have nine digits behind the point, lengths twelve. So a third
/// difference over 1 ms is wrong by 4 degrees/s^3 (of 8000) or 0.004 m/s^3 (of 10) at the most.
inline constexpr double kRampTolerance = 2e-4;
inline constexpr double kAngleDigit_deg = 1e-9;
inline constexpr double kLengthDigit_m = 1e-12;

/// The last four set-points, cycle by cycle.
class TickLimits {
 public:
  explicit TickLimits(const ArmModel& arm) : arm_(arm) {}

  /// The arm has rested at this set-point: before a motion, and where the loop has stood still for so long
  /// that the servos have.
  void rest(const std::array<double, 4>& theta_deg, const std::array<double, 3>& tcp_m);
  /// Nothing is known of the cycles before.
  void forget() noexcept { known_ = 0; }
  void add(const std::array<double, 4>& theta_deg, const std::array<double, 3>& tcp_m) noexcept;
  /// The newest set-point against those before it.
  void measure(std::uint64_t cycle, Peaks& peaks) const noexcept;

  /// Return "" or the quantity beyond its limit. For joint motions: a joint's. For lines and arcs: the
  /// tool's.
  [[nodiscard]] std::string joint_fault(const Peaks& peaks) const;
  [[nodiscard]] std::string tool_fault(const Peaks& peaks) const;

 private:
  [[nodiscard]] double period_s() const noexcept { return static_cast<double>(arm_.period_ns) * 1e-9; }

  ArmModel arm_;
  std::size_t known_{0};
  std::array<std::array<double, 4>, 4> theta_deg_{};  ///< newest first
  std::array<std::array<double, 3>, 4> tcp_m_{};
};

}  // namespace corbot::soak
