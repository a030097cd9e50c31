// SPDX-License-Identifier: Apache-2.0
// Stops, pauses and overrides random lines and arcs at random instants. The tests check every limit of every
// joint and of the tool at every tick, the tool's path, and rest in time.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <iostream>
#include <memory>
#include <numeric>
#include <optional>
#include <random>
#include <string>
#include <variant>
#include <vector>

#include "corbot/motion/path.h"
#include "corbot/motion/rate_curve.h"
#include "corbot/motion/rate_stop.h"
#include "limit_ticks.h"
#include "random_rates.h"
#include "rt/cycle/motion_rate.h"
#include "rt/cycle/rate_check.h"
#include "rt/cycle/set_point_check.h"

namespace corbot::property_rate_stops_test {
namespace {

using rate::kPath;
using rate::RatePlan;
using test::joints_in;
using test::state_of;

constexpr double kTick_s = 1e-3;
constexpr double kWithin = 1.000'01;

/// Returns the multiple of max(v/a + a/j) within which each motion rests.
double most_ramps(const PlanSettings& s) {
  const bool is_full = s.speed_ratio == 1.0 &&
                       *std::min_element(s.joint_speed_ratio.begin(), s.joint_speed_ratio.end()) == 1.0;
  return is_full ? 3.1 : 4.0;
}

double ramp_s(const rate::RateLimits& limits) {
  double most_s = 0.0;
  for (const rate::RateLimit& limit : limits)
    most_s = std::max(most_s, limit.speed / limit.acceleration + limit.acceleration / limit.jerk);
  return most_s;
}

class RateStops : public test::RandomRates {
 protected:
  /// Half of the stops are by what lies ahead, which is never slower. So are those that have begun.
  void stop(const RatePlan& plan, const rate::RateLimits& limits) {
    rate::RateGovernor slow = governor_;
    slow.seek(0.0);
    if (slow.is_at_rest() || (!governor_.is_stopping() && in(0.0, 1.0) < 0.5)) return governor_.seek(0.0);
    search_.begin(governor_, plan.law.view(), plan.shares, limits.view());
    for (int call = 0; call < rate::StopSearch::kCalls; ++call) (void)search_.step();
    if (search_.found() == nullptr) return governor_.seek(0.0);
    std::vector<double>& shares = governor_.is_stopping() ? later_shares_ : shares_;
    const double slow_s = until_rest_s(slow);
    governor_.stop(quick_.emplace(*search_.found()));
    const double quick_s = until_rest_s(governor_);
    EXPECT_LE(quick_s, slow_s);
    shares.push_back(quick_s / slow_s);
  }
  static double until_rest_s(rate::RateGovernor governor) {
    double t_s = 0.0;
    for (; !governor.is_at_rest(); t_s += kTick_s) governor.advance(kTick_s);
    return t_s;
  }

  /// Virtual times of a motion that is overridden a few times, and paused, and then stopped. Sets how long
  /// the stop takes.
  std::vector<double> run(const RatePlan& plan, const rate::RateLimits& limits, double& stop_s) {
    const double duration_s = plan.law.duration_s();
    governor_.begin(plan.curve, in(0.0, 1.0) < 0.5 ? 1.0 : in(0.0, 1.0));
    int overrides = static_cast<int>(in(0.0, 4.0));
    // Half of the changes come while the one before is still under way.
    const auto next_s = [&] { return in(0.0, in(0.0, 1.0) < 0.5 ? 0.3 : duration_s); };
    double change_s = next_s(), stopped_s = -1.0;
    std::vector<double> times_s{0.0};
    while (governor_.time_s() < duration_s && !(stopped_s >= 0.0 && governor_.is_at_rest())) {
      const double now_s = static_cast<double>(times_s.size() - 1) * kTick_s;
      if (stopped_s < 0.0 && now_s >= change_s) {
        if (overrides == 0 || in(0.0, 1.0) < 0.3) {
          stop(plan, limits);
        } else {
          governor_.seek(in(0.0, 1.0) < 0.5 ? 1.0 : in(0.0, 1.0));
        }
        if (overrides-- == 0) stopped_s = now_s;
        change_s = now_s + next_s();
      }
      if (governor_.is_stopping() && in(0.0, 1.0) < 0.02) stop(plan, limits);
      governor_.advance(kTick_s);
      times_s.push_back(governor_.time_s());
    }
    stop_s = stopped_s < 0.0 ? 0.0 : static_cast<double>(times_s.size() - 1) * kTick_s - stopped_s;
    ++(governor_.is_at_rest() ? rested_ : ended_);
    return times_s;
  }

  /// The task refuses none of these set-points.
  void expect_taken(const RatePlan& plan, const std::vector<double>& times_s) {
    rt::DifferenceCheck check;
    check.begin(joints_in(plan.knots.front().z));
    for (const double t_s : times_s) {
      const rt::SetPointVerdict verdict = check.see(arm_, joints_in(state_of(plan, t_s)), kTick_s);
      ASSERT_TRUE(verdict.ok) << "joint " << verdict.alarm.joint << " at " << t_s;
    }
    for (int held = 0; held < 3; ++held)
      ASSERT_TRUE(check.see(arm_, joints_in(state_of(plan, times_s.back())), kTick_s).ok);
  }

  template <class Motion>
  void check(const PlanSettings& s, const Motion& motion, const Joints& start_q) {
    const auto planned = rate::plan_rate(arm_, s, motion, start_q, 0.0);
    if (!std::holds_alternative<RatePlan>(planned)) return;
    const auto& plan = std::get<RatePlan>(planned);
    const rate::RateLimits limits(rate::limits_of(arm_, s, motion));
    const double bound_s = most_ramps(s) * ramp_s(limits) + kTick_s;
    for (int k = 0; k < 4; ++k) {
      SCOPED_TRACE(k);
      double stop_s = 0.0;
      const std::vector<double> times_s = run(plan, limits, stop_s);
      ASSERT_TRUE(std::is_sorted(times_s.begin(), times_s.end()));
      ASSERT_LE(stop_s, bound_s);
      longest_ = std::max(longest_, stop_s / bound_s);
      const auto set_points = [&](double t_s) {
        const auto tick = static_cast<std::size_t>(std::lround(t_s / kTick_s));
        return std::optional(joints_in(state_of(plan, times_s[std::min(tick, times_s.size() - 1)])));
      };
      ASSERT_NO_FATAL_FAILURE(expect_taken(plan, times_s));
      const double lasts_s = static_cast<double>(times_s.size() - 1) * kTick_s;
      const test::TickShares shares = test::LimitTicks(arm_, s, true, lasts_s, set_points).run();
      all_.take(shares.joint());
      all_.take(shares.tool);
      all_.take(shares.turning);
      const rate::State end = state_of(plan, times_s.back());
      const Vector3 wanted = point_at(motion, end[kPath]).position_m;
      ASSERT_LE(norm(arm_.kinematics.forward(joints_in(end)).position_m - wanted), 1e-6);
    }
  }

  /// A motion that has passed the task's check; the plan owns its path.
  struct Passed {
    ArmModel arm;  ///< in the command's frames
    rate::RatePath path;
  };
  /// The first command of a plan. Nothing: none that moves along a path.
  std::optional<Passed> pass(const PlanResult& result, int number) {
    if (!std::holds_alternative<std::vector<Command>>(result) || result.rates.empty()) return std::nullopt;
    Command command = std::get<std::vector<Command>>(result).front();
    command.id = static_cast<std::uint64_t>(number + 1);
    const PlannedRate& planned = result.rates.front();
    Passed passed{arm_, {planned.knots, {planned.pieces, command.duration_s, planned.knots.back().lambda_s}}};
    rt::take_frames(command, passed.arm.kinematics);
    std::optional<rt::CommandVerdict> verdict;
    while (!verdict) verdict = check_->step(passed.arm, command, passed.path);
    EXPECT_EQ(verdict->verdict, Verdict::kDone);
    return passed;
  }

  std::unique_ptr<rt::RateCheck> check_ = std::make_unique<rt::RateCheck>();
  rate::RateGovernor governor_;
  rate::StopSearch search_;
  std::optional<rate::RateCurve> quick_;
  std::vector<double> shares_;        ///< of the time that stops would take by the whole motion
  std::vector<double> later_shares_;  ///< of the time that they would take by the curve before
  test::LimitShares all_;
  double longest_{};
  int rested_{}, ended_{};
};

TEST_P(RateStops, KeepEveryLimitAndRestInTime) {
  const int cases = test::cases(250);
  for (int i = 0; i < cases; ++i) {
    SCOPED_TRACE(i);
    const auto [s, commands] = random_case(i);
    for (const Command& command : commands) {
      if (command.kind == MotionKind::kLine) {
        ASSERT_NO_FATAL_FAILURE(check(s, command.line, command.start_q));
      } else if (command.kind == MotionKind::kArc) {
        ASSERT_NO_FATAL_FAILURE(check(s, command.arc, command.start_q));
      }
    }
  }
  const auto middle = shares_.begin() + static_cast<std::ptrdiff_t>(shares_.size() / 2);
  std::nth_element(shares_.begin(), middle, shares_.end());
  const double anew = std::accumulate(later_shares_.begin(), later_shares_.end(), 0.0) /
                      static_cast<double>(later_shares_.size());
  std::cout << rested_ << " rested, " << ended_ << " ended before; " << all_.speed << " " << all_.acceleration
            << " " << all_.jerk << "; longest stop " << longest_
            << " of its bound, median by what lies ahead " << *middle << " of the other, sought anew " << anew
            << "\n";
  EXPECT_LT(*middle, 0.95);
  EXPECT_LT(anew, 0.99);
  EXPECT_GT(rested_, cases / 4);
  EXPECT_LE(all_.greatest(), kWithin);
  EXPECT_GT(all_.jerk, 0.95) << "stops use the reserve";
}

/// A full-speed line, and what the task's check has found out.
TEST_P(RateStops, TheTaskSeeksAQuickerCurveUntilItRests) {
  const auto motion = std::make_unique<rt::MotionRate>();
  const Planner planner(arm_);
  double task_s = 0.0, once_s = 0.0;
  for (int i = 0, stops = 0; stops < 40; ++i) {
    ASSERT_LT(i, 4000);
    const PlanStart from = start(i);
    const PlanResult result =
        planner.move_s(from, {}, near(arm_.kinematics.forward(from.position_q).position_m, 0.2), 0.0);
    const auto passed = pass(result, i);
    if (!passed) continue;
    const rate::RatePath& path = passed->path;
    motion->rest();
    motion->set_target(1.0);
    motion->begin(path, *check_);
    governor_.begin(check_->curve(), 1.0);
    for (const double at_s = in(0.0, path.law.duration_s); governor_.time_s() < at_s;) {
      motion->advance(kTick_s);
      governor_.advance(kTick_s);
    }
    motion->set_target(0.0);
    governor_.seek(0.0);
    for (int call = 0; call <= rate::StopSearch::kCalls; ++call) governor_.advance(kTick_s);
    once_s += kTick_s * rate::StopSearch::kCalls;
    const rate::RateLimits limits(check_->limits());
    search_.begin(governor_, path.law, check_->shares(), limits.view());
    while (!search_.step()) continue;
    if (search_.found() != nullptr) governor_.stop(*search_.found());
    for (; !motion->holding() && !motion->finished(); task_s += kTick_s) motion->advance(kTick_s);
    for (; !governor_.is_at_rest() && governor_.time_s() < path.law.duration_s; once_s += kTick_s)
      governor_.advance(kTick_s);
    ++stops;
  }
  std::cout << task_s / once_s << " of the time that stops take whose curve is sought once\n";
  EXPECT_LT(task_s, 0.985 * once_s);
}

/// Overrides, pauses and stops at random cycles, half of them while the one before is under way. Then the
/// rate is 1 until the end.
std::vector<double> times_of(rt::MotionRate& motion, double duration_s, double dt_s,
                             std::mt19937_64& random) {
  const auto in = [&](double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(random);
  };
  std::vector<double> times_s{0.0};
  for (int changes = 12; changes >= 0; --changes) {
    const double kind = in(0.0, 1.0);
    motion.set_target(changes == 0 || kind < 0.3 ? 1.0 : kind < 0.7 ? 0.0 : in(0.0, 1.0));
    const double lasts_s = changes == 0 ? duration_s + 60.0 : in(0.0, in(0.0, 1.0) < 0.5 ? 0.03 : 0.2);
    for (double t_s = 0.0; t_s < lasts_s && !motion.finished(); t_s += dt_s) {
      motion.advance(dt_s);
      times_s.push_back(motion.virtual_time_s());
    }
  }
  return times_s;
}

TEST_P(RateStops, TheTaskKeepsEveryLimitAtEachPeriod) {
  const auto motion = std::make_unique<rt::MotionRate>();
  const int wanted = std::max(1, test::cases(6));
  for (int i = 0, taken = 0; taken < wanted; ++i) {
    SCOPED_TRACE(i);
    ASSERT_LT(i, 4000);
    const PlanStart from = start(i);
    const PlanSettings s = settings(i, from);
    const Planner planner(arm_);
    const Vector3 here = arm_.kinematics.forward(from.position_q).position_m;
    const Vector3 p2 = near(here, 0.1), p3 = near(here, 0.1);
    const PlanResult result =
        i % 2 == 0 ? planner.move_s(from, s, p2, 0.0) : planner.move_c(from, s, here, p2, p3);
    const auto passed = pass(result, i);
    if (!passed) continue;
    const rate::RatePath& path = passed->path;
    const ArmModel& framed = passed->arm;
    ++taken;
    for (const double dt_s : {1e-4, 1e-3, 5e-3}) {
      SCOPED_TRACE(dt_s);
      motion->rest();
      motion->set_target(in(0.0, 1.0) < 0.5 ? 1.0 : in(0.0, 1.0));
      motion->begin(path, *check_);
      const std::vector<double> times_s = times_of(*motion, path.law.duration_s, dt_s, random_);
      ASSERT_TRUE(motion->finished())
          << "a motion that goes on comes to its end, after " << path.law.duration_s << " s";
      ASSERT_TRUE(std::is_sorted(times_s.begin(), times_s.end()));
      const auto joints_at = [&](std::size_t cycle) {
        const double t_s = times_s[std::min(cycle, times_s.size() - 1)];
        return joints_in(rate::state_at(path.knots, path.law.at(t_s).lambda_s));
      };
      rt::DifferenceCheck differences;
      differences.begin(joints_at(0));
      for (std::size_t k = 0; k < times_s.size() + 3; ++k)
        ASSERT_TRUE(differences.see(framed, joints_at(k), dt_s).ok) << "cycle " << k;
      const auto set_points = [&](double t_s) {
        return std::optional(joints_at(static_cast<std::size_t>(std::lround(t_s / dt_s))));
      };
      const double lasts_s = static_cast<double>(times_s.size() - 1) * dt_s;
      // Shorter differences are mostly rounding.
      const test::TickShares shares =
          test::LimitTicks(framed, s, true, lasts_s, set_points, std::max(dt_s, 1e-3)).run();
      ASSERT_LE(shares.joint().greatest(), kWithin);
      ASSERT_LE(shares.tool.greatest(), kWithin);
      ASSERT_LE(shares.turning.greatest(), kWithin);
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Arms, RateStops,
                         testing::Values("lynx5", "al5d_wr", "puma560", "scara_gx4", "stanford",
                                         "cartesian_ppp", "cylindrical_rpp", "polar_rrp", "xarm6"),
                         [](const auto& arm) { return std::string(arm.param); });

}  // namespace
}  // namespace corbot::property_rate_stops_test
