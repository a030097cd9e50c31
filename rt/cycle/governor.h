// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

#include "rt/cycle/governed_motion.h"
#include "rt/cycle/path_stop.h"

namespace corbot::rt {

/// Virtual time of joint motions and of the gripper. It advances at a rate u in [0, 1]; stop, pause, resume
/// and override change only the rate's target. Set-points are q(s), so the arm stays exactly on its path at
/// any rate. With w = du/dt
///     `q̇ = q' u`,   `q̈ = q'' u² + q' w`,   `q⃛ = q''' u³ + 3 q'' u w + q' w'`.
///
/// A target of 0 (Stop, Pause, Cancel, the ramp of a fault) becomes a PathStop. One of the laws stops as fast
/// as its limits allow, from its present speed and acceleration, also while it accelerates. The others follow
/// by their common path. The shortest stop that keeps every law's limits is taken. The search is repeated in
/// every cycle: laws that leave no room now may leave room a little later. A course that is known to be good
/// goes on until then.
///
/// A change to another target becomes a ramp: the cubic Hermite u(t) from (u, w) to (target, 0). Its duration
/// is the shortest on a ladder for which the running motion's laws keep acceleration and jerk limits all
/// along it. If there is none at this instant, the present law of u, which is known to be good, goes on. The
/// search is repeated in the next cycle: an accelerating motion may reach its speed first. A speed-up that
/// cannot reach its target yet goes half of the way first, which always finds room. So a paused motion always
/// resumes.
///
/// Bound of a stop, in real time from the request, with v, a, j the limits of the laws that move:
///     T_stop ≤ min(time the motion would still take, kStopBound · max(v/a + a/j)).
/// The reason: a law at the speed V and the acceleration A comes to rest within A/j + (V + A²/2j)/a + a/j.
/// For V + A²/2j ≤ v this is at most v/a + 2 a/j, and 3 √(v/j) if a is not reached. This is all if one joint
/// moves. With several joints, a joint that gives up its acceleration at its own jerk lets the others stop no
/// sooner, with any time. So for several joints the property tests have found the bound.
///
/// Real-time safe, bounded: in a cycle at most kStopSamples samples of each law, and kCandidates · kSamples,
/// twice.
class Governor {
 public:
  static constexpr int kCandidates = 24;
  static constexpr int kSamples = 32;
  static constexpr double kLadderRatio = 1.35;
  static constexpr int kStopSamples = 400;
  static constexpr double kStopBound = 2.0;

  /// Ends the motion: the rate is at its target at once.
  void rest() noexcept;
  /// Begins a motion at virtual time 0, at the target rate.
  void begin(const GovernedMotion& motion) noexcept;
  /// Restarts after the arm has come to rest on its path: the rate is 0, and ramps up to its target from
  /// there.
  void restart() noexcept;
  /// Sets the target of the rate, in [0, 1]. It takes effect with the next advance().
  void set_target(double rate) noexcept { target_ = rate; }
  /// Advances one cycle of real time. Virtual time never exceeds the motion's duration.
  void advance(double dt_s) noexcept;

  /// Returns the valid rate for an override of another process. A ratio below a thousandth would be a pause,
  /// and one that is not a number counts as 1.
  [[nodiscard]] static double valid_rate(double ratio) noexcept {
    return std::isfinite(ratio) ? std::clamp(ratio, 1e-3, 1.0) : 1.0;
  }

  [[nodiscard]] double virtual_time_s() const noexcept { return time_s_; }
  [[nodiscard]] double rate() const noexcept { return rate_; }
  [[nodiscard]] double target() const noexcept { return target_; }
  /// The motion has come to its end.
  [[nodiscard]] bool finished() const noexcept { return moving_ && time_s_ >= motion_.duration_s; }
  /// Virtual time stands still and will until the target changes.
  [[nodiscard]] bool holding() const noexcept {
    return rate_ == 0.0 && rate_change_ == 0.0 && target_ == 0.0;
  }

 private:
  /// u(t) on [0, duration_s], constant afterwards.
  struct Ramp {
    double from_rate{0.0};
    double from_change{0.0};  ///< du/dt at the beginning
    double to_rate{0.0};
    double duration_s{0.0};
    double from_time_s{0.0};  ///< virtual time at the beginning

    [[nodiscard]] double rate(double x) const noexcept;
    [[nodiscard]] double change(double x) const noexcept;            ///< du/dt
    [[nodiscard]] double change_of_change(double x) const noexcept;  ///< d²u/dt²
    [[nodiscard]] double time_s(double x) const noexcept;  ///< virtual time, x = t / duration in [0, 1]
    [[nodiscard]] bool stays_within_unit() const noexcept;
  };

  void seek_ramp() noexcept;
  void seek_stop() noexcept;
  [[nodiscard]] bool try_stops() noexcept;
  void follow_stop() noexcept;
  void follow_ramp() noexcept;
  void hold() noexcept;
  [[nodiscard]] double heading_for() const noexcept;
  [[nodiscard]] double until_rest_s() const noexcept;
  [[nodiscard]] bool try_ramps_to(double rate) noexcept;
  [[nodiscard]] bool is_feasible(const Ramp& ramp) const noexcept;
  [[nodiscard]] double shortest_ramp_s(double rate) const noexcept;
  [[nodiscard]] double longest_stop_s() const noexcept;

  GovernedMotion motion_{};
  bool moving_{false};
  double target_{1.0};
  double rate_{1.0};
  double rate_change_{0.0};
  double time_s_{0.0};
  enum class Course : unsigned char { kEven, kRamp, kStop };
  Course course_{Course::kEven};
  Ramp ramp_{};
  PathStop stop_{};
  double elapsed_s_{0.0};  ///< since the beginning of the ramp or the stop
};

/// Returns the end of the ladder, from the laws' own peaks and their limits: no ramp of a motion need be
/// longer.
[[nodiscard]] double longest_ramp_s(const GovernedMotion& motion) noexcept;

}  // namespace corbot::rt
