// SPDX-License-Identifier: Apache-2.0
#include "motion/stop_judge.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "rt/cycle/path_evaluation.h"

namespace corbot::test {
namespace {

/// One cycle to see the request, one to report, one since the state was seen.
constexpr int kCycles = 3;
/// Shorter ones say more of cycles than of stops.
constexpr double kNotable_s = 0.03;

/// v, A >= -√(2 j v): the shortest stop with |acceleration| <= a and |jerk| <= j.
double shortest_stop_s(double v, double acceleration, double a, double j) {
  const double to_take = v + acceleration * acceleration / (2.0 * j);
  const double peak = std::max(std::min(a, std::sqrt(std::max(0.0, j * to_take))), -acceleration);
  if (!(peak > 0.0)) return 0.0;
  const double held_s = std::max(0.0, (to_take - peak * peak / j) / peak);
  return (acceleration + peak) / j + held_s + peak / j;
}

}  // namespace

StopJudge::StopJudge(const ArmModel& arm) : arm_(arm), dt_s_(static_cast<double>(arm.period_ns) * 1e-9) {}

void StopJudge::begin(const Command& command) {
  motion_ = rt::governed_motion(arm_, command);
  time_s_ = rate_ = change_ = 0.0;
  is_requested_ = false;
}

double StopJudge::speed(std::size_t i) const {
  const rt::LawSegments& law = motion_.laws[i].law;
  return std::abs(law.velocity(law.segment_at(time_s_, 0), time_s_)) * rate_;
}

double StopJudge::acceleration(std::size_t i) const {
  const rt::LawSegments& law = motion_.laws[i].law;
  const std::size_t segment = law.segment_at(time_s_, 0);
  const double velocity = law.velocity(segment, time_s_);
  const double acceleration = law.acceleration(segment, time_s_);
  return (velocity < 0.0 ? -1.0 : 1.0) * (acceleration * rate_ * rate_ + velocity * change_);
}

void StopJudge::request() {
  if (is_requested_) return;
  is_requested_ = true;
  ticks_ = 0;
  shortest_s_ = 0.0;
  planned_s_ = 0.0;
  for (std::size_t i = 0; i < motion_.count; ++i) {
    const double a = motion_.laws[i].acceleration_limit;
    const double j = motion_.laws[i].jerk_limit;
    const double planned = std::abs(motion_.laws[i].law.acceleration_at_begin(1)) * rate_ * rate_;
    speed_[i] = speed(i);
    shortest_s_ = std::max(shortest_s_, shortest_stop_s(speed(i), acceleration(i), a, j));
    planned_s_ = std::max(planned_s_, shortest_stop_s(speed(i), std::max(planned, acceleration(i)), a, j));
  }
}

bool StopJudge::see(const Snapshot& snapshot) {
  if (snapshot.command_id != 0) {
    change_ = (snapshot.virtual_rate - rate_) / dt_s_;
    if (snapshot.virtual_time_s <= dt_s_) change_ = 0.0;
    rate_ = snapshot.virtual_rate;
    time_s_ = snapshot.virtual_time_s;
  }
  if (!is_requested_) return true;
  ++ticks_;
  for (std::size_t i = 0; i < motion_.count; ++i) {
    const double rise = speed(i) - speed_[i];
    const double a = motion_.laws[i].acceleration_limit;
    const double may_rise = a * a / (2.0 * motion_.laws[i].jerk_limit);
    greatest_rise = std::max(greatest_rise, rise / may_rise);
    if (rise <= most().rise * may_rise + a * dt_s_) continue;
    error = fmt::format("law {} faster by {}, {} s after a stop that leaves {}", i, rise, ticks_ * dt_s_,
                        may_rise);
    return false;
  }
  return true;
}

bool StopJudge::rest() {
  if (!is_requested_) return true;
  is_requested_ = false;
  if (motion_.count == 0) return true;  // nothing moves, or a path, which has no law
  const double taken_s = (ticks_ - kCycles) * dt_s_;
  if (shortest_s_ > kNotable_s) {
    greatest_share = std::max(greatest_share, taken_s / shortest_s_);
    ++stops;
    if (taken_s > kNearlyAll * shortest_s_) ++long_stops;
  }
  const double most_s = most().duration * (motion_.count == 1 ? shortest_s_ : planned_s_);
  if (taken_s <= most_s) return true;
  error = fmt::format("at rest after {} s, where {} s are possible", taken_s, shortest_s_);
  return false;
}

}  // namespace corbot::test
