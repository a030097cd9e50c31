// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <limits>
#include <optional>
#include <utility>

#include "corbot/arm/arm_model.h"
#include "planner/plan/plan.h"
#include "rt/cycle/path_evaluation.h"

// Measures how near a planned motion comes to each limit of each joint and of the tool. It takes the
// set-points at 1 kHz unless the caller gives another rate. A difference over a tick is a mean of the
// derivative, so it never exceeds the derivative's peak.

namespace corbot::test {

/// Greatest shares of three limits; 1 is the limit itself.
struct LimitShares {
  double speed{}, acceleration{}, jerk{};

  void take(const LimitShares& other) noexcept {
    speed = std::max(speed, other.speed);
    acceleration = std::max(acceleration, other.acceleration);
    jerk = std::max(jerk, other.jerk);
  }
  [[nodiscard]] double greatest() const noexcept { return std::max({speed, acceleration, jerk}); }
};

struct TickShares {
  std::array<LimitShares, kMaxJoints> joints{};
  LimitShares tool{};       ///< lengths of the vectors, base frame; of lines and arcs alone
  LimitShares turning{};    ///< angular velocity and its differences, or those of the followed angles
  bool is_reachable{true};  ///< false: a set-point has no joints

  /// The greatest of all joints.
  [[nodiscard]] LimitShares joint() const noexcept {
    LimitShares all;
    for (const LimitShares& one : joints) all.take(one);
    return all;
  }
};

/// The joints at a time of a motion; after its end, those there. Nothing: the arm has none for this place.
using SetPoints = std::function<std::optional<Joints>(double t_s)>;

/// Runs one motion tick by tick.
class LimitTicks {
 public:
  /// `is_path`: a line or an arc, so the tool's limits count, too.
  LimitTicks(const ArmModel& arm, const PlanSettings& settings, bool is_path, double duration_s,
             SetPoints set_points, double tick_s = 1e-3)
      : arm_(arm),
        is_path_(is_path),
        duration_s_(duration_s),
        set_points_(std::move(set_points)),
        tick_s_(tick_s) {
    for (std::size_t i = 0; i < arm.dof; ++i) {
      arm_.joints[i].speed_q_s *= settings.joint_speed_ratio[i] * (is_path_ ? 1.0 : settings.speed_ratio);
    }
    arm_.path.speed_m_s *= settings.speed_ratio;
    arm_.path.rotation_speed_rad_s *= settings.speed_ratio;
  }

  /// A motion of more ticks than kMostTicks is looked at every few ticks, each with the three before it.
  [[nodiscard]] TickShares run() {
    TickShares shares;
    const int ticks = static_cast<int>(std::ceil(duration_s_ / tick_s_)) + 3;
    const int stride = 1 + ticks / kMostTicks;
    for (int k = 0; k <= ticks && shares.is_reachable; k += stride) {
      for (int back = stride == 1 && k > 0 ? 0 : 3; back >= 0; --back) {
        std::rotate(last_.begin(), last_.end() - 1, last_.end());
        last_[0] = at(k - back, shares);
      }
      look(shares);
    }
    return shares;
  }

 private:
  static constexpr int kMostTicks = 20'000;
  /// A set-point's (rad or m), and a tool's: some units in the last place of numbers up to 4. The n-th
  /// difference has 2^n times that.
  static constexpr double kRounding = 2e-15;

  struct Tick {
    Joints q{};
    Pose tool{};
    Angles angles_rad{};
  };
  Tick at(int tick, TickShares& shares) const {
    const std::optional<Joints> there = set_points_(std::max(0, tick) * tick_s_);
    shares.is_reachable = shares.is_reachable && there;
    const Joints q = there.value_or(last_[0].q);
    return {q, is_path_ ? arm_.kinematics.forward(q) : Pose{}, arm_.kinematics.followed().at(q)};
  }

  /// Base frame.
  [[nodiscard]] Vector3 turned_rad(const Tick& from, const Tick& to) const {
    if (arm_.kinematics.follows() != Follows::kFull)
      return {to.angles_rad[0] - from.angles_rad[0], to.angles_rad[1] - from.angles_rad[1], 0.0};
    const Quaternion d = to.tool.orientation * conjugate(from.tool.orientation);
    return std::copysign(2.0, d.w) * Vector3{d.x, d.y, d.z};  // the sine of less than 0.01 rad
  }

  /// Over the limits, from three differences of one quantity, the newest first.
  template <class T, class Length>
  LimitShares shares(const std::array<T, 3>& d, double v, double a, double j, const Length& length) const {
    const auto share = [&](const T& difference, double rounding, double span, double limit) {
      return std::max(0.0, length(difference) - rounding) / (span * limit);
    };
    return {share(d[0], 2.0 * kRounding, tick_s_, v),
            share(d[0] - d[1], 4.0 * kRounding, tick_s_ * tick_s_, a),
            share(d[0] - d[1] - (d[1] - d[2]), 8.0 * kRounding, tick_s_ * tick_s_ * tick_s_, j)};
  }

  void look(TickShares& shares_) const {
    for (std::size_t i = 0; i < arm_.dof; ++i) {
      const std::array<double, 3> d{last_[0].q[i] - last_[1].q[i], last_[1].q[i] - last_[2].q[i],
                                    last_[2].q[i] - last_[3].q[i]};
      const JointLimits& limits = arm_.joints[i];
      shares_.joints[i].take(shares(d, limits.speed_q_s, limits.acceleration_q_s2, limits.jerk_q_s3,
                                    [](double x) { return std::abs(x); }));
    }
    if (!is_path_) return;
    std::array<Vector3, 3> moved{}, turned{};
    for (std::size_t k = 0; k < 3; ++k) {
      moved[k] = last_[k].tool.position_m - last_[k + 1].tool.position_m;
      turned[k] = turned_rad(last_[k + 1], last_[k]);
    }
    const PathLimits& path = arm_.path;
    const auto length = [](const Vector3& x) { return norm(x); };
    shares_.tool.take(shares(moved, path.speed_m_s, path.acceleration_m_s2, path.jerk_m_s3, length));
    shares_.turning.take(shares(turned, path.rotation_speed_rad_s, path.rotation_acceleration_rad_s2,
                                path.rotation_jerk_rad_s3, length));
  }

  ArmModel arm_;
  bool is_path_;
  double duration_s_;
  SetPoints set_points_;
  double tick_s_;
  std::array<Tick, 4> last_{};
};

/// All limits are the arm's, the speeds scaled by the settings. `rate`: of a line or an arc.
inline TickShares tick_shares(const ArmModel& arm, const PlanSettings& settings, const Command& command,
                              const PlannedRate& rate = {}) {
  ArmModel framed = arm;
  rt::take_frames(command, framed.kinematics);
  const rt::SetPoint base{command.start_q};
  const auto set_points = [&](double t_s) -> std::optional<Joints> {
    if (!rate.pieces.empty()) {
      const rate::RatePieces law{rate.pieces, command.duration_s, rate.knots.back().lambda_s};
      const rate::State z = rate::state_at(rate.knots, law.at(t_s).lambda_s);
      Joints q{};
      std::copy_n(z.begin(), q.size(), q.begin());
      return q;
    }
    return rt::evaluate_command(framed, command, base, t_s).position_q;
  };
  return LimitTicks(framed, settings, knots_of(command) != nullptr, command.duration_s, set_points).run();
}

}  // namespace corbot::test
