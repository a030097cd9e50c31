// SPDX-License-Identifier: Apache-2.0
#include "soak/tick_limits.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "corbot/units.h"

namespace corbot::soak {
namespace {

/// Sums of the coefficients of a first, second and third difference: how much half a digit of rounding grows.
constexpr double kRoundings[] = {1.0, 2.0, 4.0};

template <std::size_t kAxes>
using History = std::array<std::array<double, kAxes>, 4>;

template <std::size_t kAxes>
double difference(const History<kAxes>& at, int order, std::size_t i) noexcept {
  if (order == 1) return at[0][i] - at[1][i];
  if (order == 2) return at[0][i] - 2.0 * at[1][i] + at[2][i];
  return at[0][i] - 3.0 * at[1][i] + 3.0 * at[2][i] - at[3][i];
}

double length(const History<3>& at, int order) noexcept {
  return std::hypot(difference(at, order, 0), difference(at, order, 1), difference(at, order, 2));
}

void raise(Peaks::Of& peak, double value, std::uint64_t cycle, std::size_t joint = 0) noexcept {
  if (value > peak.value) peak = {value, cycle, joint};
}

std::string beyond(const char* what, const Peaks::Of& peak, double limit, double tolerance) {
  if (peak.value <= limit * (1.0 + kRampTolerance) + tolerance) return "";
  return fmt::format("{} {:.6g} in cycle {}, allowed {:.6g}", what, peak.value, peak.cycle, limit);
}

}  // namespace

void TickLimits::rest(const std::array<double, 4>& theta_deg, const std::array<double, 3>& tcp_m) {
  theta_deg_.fill(theta_deg);
  tcp_m_.fill(tcp_m);
  known_ = 4;
}

void TickLimits::add(const std::array<double, 4>& theta_deg, const std::array<double, 3>& tcp_m) noexcept {
  std::rotate(theta_deg_.rbegin(), theta_deg_.rbegin() + 1, theta_deg_.rend());
  std::rotate(tcp_m_.rbegin(), tcp_m_.rbegin() + 1, tcp_m_.rend());
  theta_deg_[0] = theta_deg;
  tcp_m_[0] = tcp_m;
  known_ = std::min<std::size_t>(known_ + 1, 4);
}

void TickLimits::measure(std::uint64_t cycle, Peaks& peaks) const noexcept {
  const double dt_s = period_s();
  if (known_ >= 2) {
    raise(peaks.tool_speed, length(tcp_m_, 1) / dt_s, cycle);
    for (std::size_t i = 0; i < 4; ++i) {
      const double step_deg = difference(theta_deg_, 1, i);
      peaks.up_deg[i] = std::max(peaks.up_deg[i], step_deg);
      peaks.down_deg[i] = std::max(peaks.down_deg[i], -step_deg);
    }
  }
  if (known_ >= 3) raise(peaks.tool_acceleration, length(tcp_m_, 2) / (dt_s * dt_s), cycle);
  if (known_ >= 4) raise(peaks.tool_jerk, length(tcp_m_, 3) / (dt_s * dt_s * dt_s), cycle);
  for (std::size_t i = 0; i < std::min<std::size_t>(arm_.dof, 4); ++i) {
    const JointLimits& limits = arm_.joints[i];
    // As shares of the limits, what rounding may have made of them taken off.
    const auto share = [&](int order, double limit) {
      const double unit = std::pow(dt_s, order);
      const double rounding_deg = kRoundings[order - 1] * kAngleDigit_deg;
      return (std::abs(difference(theta_deg_, order, i)) - rounding_deg) / unit / to_degrees(limit);
    };
    if (known_ >= 3) raise(peaks.joint_acceleration, share(2, limits.acceleration_q_s2), cycle, i);
    if (known_ >= 4) raise(peaks.joint_jerk, share(3, limits.jerk_q_s3), cycle, i);
  }
}

std::string TickLimits::joint_fault(const Peaks& peaks) const {
  const auto of = [](const char* what, const Peaks::Of& peak) {
    return beyond(fmt::format("joint {}: {} in shares of its limit", peak.joint, what).c_str(), peak, 1.0,
                  0.0);
  };
  const std::string acceleration = of("acceleration", peaks.joint_acceleration);
  return acceleration.empty() ? of("jerk", peaks.joint_jerk) : acceleration;
}

std::string TickLimits::tool_fault(const Peaks& peaks) const {
  const double dt_s = period_s();
  const auto rounding = [&](int order) {
    return 2.0 * kRoundings[order - 1] * kLengthDigit_m / std::pow(dt_s, order);
  };
  std::string fault = beyond("the tool at m/s", peaks.tool_speed, arm_.path.speed_m_s, rounding(1));
  if (fault.empty())
    fault = beyond("the tool's acceleration in m/s^2", peaks.tool_acceleration, arm_.path.acceleration_m_s2,
                   rounding(2));
  if (fault.empty())
    fault = beyond("the tool's jerk in m/s^3", peaks.tool_jerk, arm_.path.jerk_m_s3, rounding(3));
  return fault;
}

}  // namespace corbot::soak
