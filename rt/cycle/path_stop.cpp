// SPDX-License-Identifier: Apache-2.0
#include "rt/cycle/path_stop.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace corbot::rt {
namespace {

constexpr int kSamplesOfSegment = 8;
/// Margin for the variation of the laws' differences between two samples.
constexpr double kDifferenceMargin = 0.04;
constexpr double kRateRounding = 1e-7;
constexpr int kStepsOfTurn = 8;
constexpr double kShortestStep_s = 2e-3;
/// The jerks that a step tries: shares of the leading law's jerk, none, and the jerk at which virtual time
/// continues as it does.
constexpr std::array<double, 6> kStepJerks{-1.0, -0.75, -0.5, -0.25, 0.0, 1.0};

/// The derivatives by virtual time, positive while the law moves on.
struct Derivatives {
  double velocity;
  double acceleration;
  double jerk;
};

Derivatives derivatives(const LawSegments& law, std::size_t segment, double time_s) noexcept {
  const double sign = law.sign();
  return {sign * law.velocity(segment, time_s), sign * law.acceleration(segment, time_s),
          sign * law.jerk(segment)};
}

/// The speed by real time.
struct Speed {
  double velocity;
  double acceleration;
};

Speed speed(const Derivatives& of, const RateState& at) noexcept {
  return {of.velocity * at.rate, of.acceleration * at.rate * at.rate + of.velocity * at.change};
}

Speed speed(const LawSegments& law, const RateState& at) noexcept {
  return speed(derivatives(law, law.segment_at(at.time_s, 0), at.time_s), at);
}

/// Returns the rate at which a law has this velocity and acceleration.
RateState rate_for(const Derivatives& of, double time_s, const Speed& wanted) noexcept {
  if (!(of.velocity > 0.0)) return {time_s, 0.0, 0.0};
  const double rate = wanted.velocity / of.velocity;
  return {time_s, rate, (wanted.acceleration - of.acceleration * rate * rate) / of.velocity};
}

bool is_within(double value, double margin, double limit) noexcept {
  return std::abs(value) + margin <= limit * (1.0 + kLimitTolerance);
}

}  // namespace

PathStop::PathStop(const GovernedMotion& motion, const RateState& from, std::size_t leader,
                   double share) noexcept
    : leader_(leader), from_(from) {
  const GovernedLaw& leading = motion.laws[leader];
  const Speed now = speed(leading.law, from);
  acceleration_limit_ = share * leading.acceleration_limit;
  jerk_limit_ = share * leading.jerk_limit;
  begin_ = leading.law.position(leading.law.segment_at(from.time_s, 0), from.time_s);
  distance_ = leading.law.distance() - begin_;
  start_ = {0.0, 0.0, now.velocity, now.acceleration, 0.0};
  tail_ = StopLaw(now.velocity, now.acceleration, acceleration_limit_, jerk_limit_);
}

PathStop::Step PathStop::leading_at(double elapsed_s) const noexcept {
  if (elapsed_s >= tail_begin_s_) {
    const double t_s = elapsed_s - tail_begin_s_;
    return {elapsed_s, tail_way_ + tail_.way(t_s), tail_.velocity(t_s), tail_.acceleration(t_s), 0.0};
  }
  std::size_t i = count_ - 1;
  while (i > 0 && elapsed_s < steps_[i].begin_s) --i;
  const Step& step = steps_[i];
  const double t_s = elapsed_s - step.begin_s;
  return {elapsed_s,
          step.way + t_s * (step.velocity + t_s * (step.acceleration / 2.0 + t_s * step.jerk / 6.0)),
          step.velocity + t_s * (step.acceleration + t_s * step.jerk / 2.0),
          step.acceleration + t_s * step.jerk, 0.0};
}

RateState PathStop::at(const GovernedMotion& motion, double elapsed_s) const noexcept {
  const LawSegments& law = motion.laws[leader_].law;
  const Step leading = leading_at(elapsed_s);
  std::size_t segment = law.segment_at(from_.time_s, 0);
  const double time_s = std::max(from_.time_s, law.time_at(begin_ + leading.way, &segment));
  if (elapsed_s >= duration_s()) return {time_s, 0.0, 0.0};
  return rate_for(derivatives(law, segment, time_s), time_s, {leading.velocity, leading.acceleration});
}

/// Goes along a stop, from sample to sample. Between two samples there are only smooth functions. Besides the
/// even samples there is one wherever a law has a corner, on either side of it.
class PathStop::Walk {
 public:
  Walk(const PathStop& stop, const GovernedMotion& motion, double most_rate, int* samples) noexcept
      : stop_(&stop),
        motion_(&motion),
        most_rate_(most_rate),
        samples_(samples),
        time_s_(stop.from_.time_s),
        before_{0.0, stop.from_.rate, stop.from_.change} {
    for (std::size_t i = 0; i < motion.count; ++i)
      segment_[i] = motion.laws[i].law.segment_at(stop.from_.time_s, 0);
  }
  [[nodiscard]] double elapsed_s() const noexcept { return elapsed_s_; }
  /// Returns the jerk at which virtual time would continue as it does.
  [[nodiscard]] double even_jerk() const noexcept;
  /// Goes at this jerk of the leading law until the given time.
  [[nodiscard]] bool goes(double jerk, double to_elapsed_s, int samples) noexcept;

 private:
  /// The rate at one sample.
  struct Sample {
    double elapsed_s;
    double rate;
    double change;
  };
  [[nodiscard]] static double greatest_between(const Sample& first, const Sample& second) noexcept;
  [[nodiscard]] bool keeps_limits() noexcept;
  [[nodiscard]] bool advance(double to_elapsed_s) noexcept;
  [[nodiscard]] bool pass_corner(double corner_s, double by_elapsed_s) noexcept;
  [[nodiscard]] double next_corner_s() const noexcept;

  const PathStop* stop_;
  const GovernedMotion* motion_;
  double most_rate_;
  int* samples_;
  std::array<std::size_t, kMaxJoints> segment_{};
  double elapsed_s_{0.0};
  double time_s_;
  double jerk_{0.0};
  Sample before_;  ///< the previous sample
};

bool PathStop::Walk::goes(double jerk, double to_elapsed_s, int samples) noexcept {
  jerk_ = jerk;
  if (!keeps_limits()) return false;
  const double begin_s = elapsed_s_;
  const double length_s = to_elapsed_s - begin_s;
  for (int i = 1; i <= samples; ++i) {
    if (!advance(i < samples ? begin_s + length_s * i / samples : to_elapsed_s)) return false;
  }
  return true;
}

double PathStop::Walk::even_jerk() const noexcept {
  const std::size_t leader = stop_->leader_;
  const Derivatives leading = derivatives(motion_->laws[leader].law, segment_[leader], time_s_);
  const Step led = stop_->leading_at(elapsed_s_);
  const RateState state = rate_for(leading, time_s_, {led.velocity, led.acceleration});
  return state.rate * (leading.jerk * state.rate * state.rate + 3.0 * leading.acceleration * state.change);
}

/// Returns a bound of the rate between two samples, between which it is taken for concave. If the rate rises
/// at the first and falls at the second, the bound is where both tangents meet.
double PathStop::Walk::greatest_between(const Sample& first, const Sample& second) noexcept {
  if (!(first.change > 0.0 && second.change < 0.0)) return std::max(first.rate, second.rate);
  const double length_s = second.elapsed_s - first.elapsed_s;
  const double rise_s =
      (second.rate - first.rate - second.change * length_s) / (first.change - second.change);
  return first.rate + first.change * std::clamp(rise_s, 0.0, length_s);
}

bool PathStop::Walk::keeps_limits() noexcept {
  if (--*samples_ < 0) return false;
  const std::size_t leader = stop_->leader_;
  const Derivatives leading = derivatives(motion_->laws[leader].law, segment_[leader], time_s_);
  const Step led = stop_->leading_at(elapsed_s_);
  const RateState state = rate_for(leading, time_s_, {led.velocity, led.acceleration});
  const Sample now{elapsed_s_, state.rate, state.change};
  if (!(greatest_between(before_, now) <= most_rate_ + kRateRounding)) return false;
  before_ = now;
  if (!(leading.velocity > 0.0)) return true;
  const double square = state.rate * state.rate;
  for (std::size_t i = 0; i < motion_->count; ++i) {
    if (i == leader) continue;
    const GovernedLaw& governed = motion_->laws[i];
    const Derivatives own = derivatives(governed.law, segment_[i], time_s_);
    // The part in common with the leading law, and the difference, which is zero if their shapes are alike.
    const double ratio = own.velocity / leading.velocity;
    const double bend = own.acceleration - ratio * leading.acceleration;
    const double acceleration = bend * square;
    if (!is_within(ratio * led.acceleration + acceleration, kDifferenceMargin * std::abs(acceleration),
                   governed.acceleration_limit)) {
      return false;
    }
    const double by_jerk = (own.jerk - ratio * leading.jerk) * square * state.rate;
    const double by_change = 3.0 * bend * state.rate * state.change;
    if (!is_within(ratio * jerk_ + by_jerk + by_change,
                   kDifferenceMargin * (std::abs(by_jerk) + std::abs(by_change)), governed.jerk_limit)) {
      return false;
    }
  }
  return true;
}

double PathStop::Walk::next_corner_s() const noexcept {
  double next_s = motion_->duration_s;
  for (std::size_t i = 0; i < motion_->count; ++i) {
    if (segment_[i] + 1 < LawSegments::kCount)
      next_s = std::min(next_s, motion_->laws[i].law.begin_s(segment_[i] + 1));
  }
  return next_s;
}

bool PathStop::Walk::pass_corner(double corner_s, double by_elapsed_s) noexcept {
  constexpr int kNewtonSteps = 3;
  const LawSegments& law = motion_->laws[stop_->leader_].law;
  const double way = law.position(segment_[stop_->leader_], corner_s) - stop_->begin_;
  double at_s = (elapsed_s_ + by_elapsed_s) / 2.0;
  for (int i = 0; i < kNewtonSteps; ++i) {
    const Step led = stop_->leading_at(at_s);
    if (!(led.velocity > 0.0)) break;
    at_s = std::clamp(at_s + (way - led.way) / led.velocity, elapsed_s_, by_elapsed_s);
  }
  elapsed_s_ = at_s;
  time_s_ = corner_s;
  if (!keeps_limits()) return false;
  for (std::size_t i = 0; i < motion_->count; ++i)
    segment_[i] = motion_->laws[i].law.segment_at(time_s_, segment_[i]);
  return keeps_limits();
}

bool PathStop::Walk::advance(double to_elapsed_s) noexcept {
  const LawSegments& law = motion_->laws[stop_->leader_].law;
  std::size_t sought = segment_[stop_->leader_];
  const double to_s = law.time_at(stop_->begin_ + stop_->leading_at(to_elapsed_s).way, &sought);
  while (next_corner_s() < to_s) {
    if (!pass_corner(next_corner_s(), to_elapsed_s)) return false;
  }
  elapsed_s_ = to_elapsed_s;
  time_s_ = to_s;
  return keeps_limits();
}

bool PathStop::plan(const GovernedMotion& motion, Turn turn, const Bounds& bounds, int* samples) noexcept {
  Walk walk(*this, motion, bounds.rate, samples);
  if (!begin_tail(0.0, bounds)) return false;
  if (turn == Turn::kStepwise && !turns_stepwise(walk, bounds)) return false;
  for (std::size_t i = 0; i < StopLaw::kSegments; ++i) {
    const double length_s = tail_.segment_s(i);
    if (length_s > 0.0 && !walk.goes(tail_.jerk(i), walk.elapsed_s() + length_s, kSamplesOfSegment))
      return false;
  }
  return true;
}

/// Begins the tail, which is one StopLaw from here on.
bool PathStop::begin_tail(double begin_s, const Bounds& bounds) noexcept {
  const Step from = count_ == 0 ? start_ : leading_at(begin_s);
  if (!(when_even(from.velocity, from.acceleration, jerk_limit_) >= 0.0)) return false;
  tail_ = StopLaw(from.velocity, from.acceleration, acceleration_limit_, jerk_limit_);
  tail_begin_s_ = begin_s;
  tail_way_ = from.way;
  return duration_s() < bounds.duration_s && tail_way_ + tail_.way(tail_.duration_s()) < distance_;
}

bool PathStop::turns_stepwise(Walk& walk, const Bounds& bounds) noexcept {
  const double step_s = std::max(tail_.segment_s(0) / kStepsOfTurn, kShortestStep_s);
  while (tail_.segment_s(0) > 0.0 && count_ < kMaxSteps) {
    if (!add_step(walk, std::min(step_s, tail_.segment_s(0)))) return false;
    if (!begin_tail(walk.elapsed_s(), bounds)) return false;
  }
  return true;
}

bool PathStop::add_step(Walk& walk, double length_s) noexcept {
  Step& step = steps_[count_];
  const Step from = count_ == 0 ? start_ : leading_at(walk.elapsed_s());
  tail_begin_s_ = std::numeric_limits<double>::infinity();
  step = from;
  ++count_;
  const double even = std::clamp(walk.even_jerk(), 0.0, jerk_limit_);
  for (const double share : kStepJerks) {
    step.jerk = share < 0.0 ? share * jerk_limit_ : share * even;
    if (step.jerk > 0.0 && from.acceleration + step.jerk * length_s > acceleration_limit_) return false;
    Walk trial = walk;
    if (!trial.goes(step.jerk, from.begin_s + length_s, 1)) continue;
    walk = trial;
    return true;
  }
  return false;
}

double shortest_stop_s(const GovernedMotion& motion, const RateState& from) noexcept {
  double shortest_s = 0.0;
  for (std::size_t i = 0; i < motion.count; ++i) {
    const GovernedLaw& governed = motion.laws[i];
    const Speed now = speed(governed.law, from);
    shortest_s = std::max(
        shortest_s, StopLaw(now.velocity, now.acceleration, governed.acceleration_limit, governed.jerk_limit)
                        .duration_s());
  }
  return shortest_s;
}

}  // namespace corbot::rt
