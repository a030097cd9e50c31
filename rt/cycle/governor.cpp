// SPDX-License-Identifier: Apache-2.0
#include "rt/cycle/governor.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace corbot::rt {
namespace {

/// Margin on the terms that the ramp adds, since they are checked in samples only.
constexpr double kRampMargin = 1.03;
/// Shares of a leading law's limits.
constexpr std::array<double, 10> kStopShares{1.0, 0.94, 0.88, 0.8, 0.7, 0.6, 0.5, 0.4, 0.3, 0.2};
/// The greatest share of the present duration at which another stop is worth taking.
constexpr double kWorthwhile = 0.98;
/// No ramp is shorter: it would end within a cycle or so.
constexpr double kShortestRamp_s = 1e-3;

struct Range {
  double lower;
  double upper;
  void include(double value) noexcept {
    lower = std::min(lower, value);
    upper = std::max(upper, value);
  }
};

/// The rate and its derivatives by real time at one sample.
struct RateSample {
  double rate;
  double change;
  double change_of_change;
};

/// A law at one sample.
struct LawSample {
  double velocity;
  double acceleration;
};

/// Tells whether a law with these derivatives, run at this rate, keeps its limits. Acceleration and jerk are
/// given as their ranges in the neighbourhood of the sample.
bool keeps_limits(const GovernedLaw& governed, const RateSample& rate, double velocity,
                  const Range& acceleration, const Range& jerk) noexcept {
  const double square = rate.rate * rate.rate;
  const double ramp_acceleration = kRampMargin * velocity * rate.change;
  const double acceleration_limit = governed.acceleration_limit * (1.0 + kLimitTolerance);
  if (!(acceleration.upper * square + ramp_acceleration <= acceleration_limit)) return false;
  if (!(acceleration.lower * square + ramp_acceleration >= -acceleration_limit)) return false;
  const double cross = 3.0 * kRampMargin * rate.rate * rate.change;
  const double cross_upper = std::max(cross * acceleration.upper, cross * acceleration.lower);
  const double cross_lower = std::min(cross * acceleration.upper, cross * acceleration.lower);
  const double ramp_jerk = kRampMargin * velocity * rate.change_of_change;
  const double cube = square * rate.rate;
  const double jerk_limit = governed.jerk_limit * (1.0 + kLimitTolerance);
  return jerk.upper * cube + cross_upper + ramp_jerk <= jerk_limit &&
         jerk.lower * cube + cross_lower + ramp_jerk >= -jerk_limit;
}

}  // namespace

double longest_ramp_s(const GovernedMotion& motion) noexcept {
  double longest_s = kShortestRamp_s;
  for (std::size_t i = 0; i < motion.count; ++i) {
    const GovernedLaw& governed = motion.laws[i];
    const double velocity = std::abs(governed.law.velocity(3, 0.0));
    const double acceleration = std::abs(governed.law.acceleration_at_begin(1));
    const double for_acceleration_s = velocity / governed.acceleration_limit;
    const double for_jerk_s = std::sqrt(velocity / governed.jerk_limit) + acceleration / governed.jerk_limit;
    longest_s = std::max(longest_s, 2.0 * for_acceleration_s + 3.0 * for_jerk_s);
  }
  return longest_s;
}

// The rate of the cubic, with x = t / T, D = from − to and W = T · w(0):
//   `u = to + (1 − x)² (D (1 + 2x) + W x)`.
double Governor::Ramp::rate(double x) const noexcept {
  const double difference = from_rate - to_rate;
  const double rest = 1.0 - x;
  return to_rate + rest * rest * (difference * (1.0 + 2.0 * x) + from_change * duration_s * x);
}

double Governor::Ramp::change(double x) const noexcept {
  const double slope = 6.0 * (from_rate - to_rate) / duration_s + 3.0 * from_change;
  return (1.0 - x) * (from_change - x * slope);
}

double Governor::Ramp::change_of_change(double x) const noexcept {
  const double slope = 6.0 * (from_rate - to_rate) / duration_s + 3.0 * from_change;
  return (2.0 * x * slope - slope - from_change) / duration_s;
}

double Governor::Ramp::time_s(double x) const noexcept {
  const double difference = from_rate - to_rate;
  const double advance = from_change * duration_s;
  // u as a polynomial in x, integrated.
  const double c2 = advance;
  const double c3 = -3.0 * difference - 2.0 * advance;
  const double c4 = 2.0 * difference + advance;
  return from_time_s + duration_s * x * (from_rate + x * (c2 / 2.0 + x * (c3 / 3.0 + x * c4 / 4.0)));
}

bool Governor::Ramp::stays_within_unit() const noexcept {
  // The only stationary point besides x = 1.
  const double divisor = 6.0 * (from_rate - to_rate) + 3.0 * from_change * duration_s;
  if (divisor == 0.0) return true;
  const double x = from_change * duration_s / divisor;
  if (!(x > 0.0 && x < 1.0)) return true;
  const double extreme = rate(x);
  return extreme >= 0.0 && extreme <= 1.0;
}

void Governor::rest() noexcept {
  moving_ = false;
  course_ = Course::kEven;
  rate_ = target_;
  rate_change_ = 0.0;
  time_s_ = 0.0;
}

void Governor::begin(const GovernedMotion& motion) noexcept {
  rest();
  motion_ = motion;
  motion_.longest_ramp_s = longest_ramp_s(motion);
  moving_ = true;
}

void Governor::restart() noexcept {
  if (moving_) hold();
}

void Governor::hold() noexcept {
  course_ = Course::kEven;
  rate_ = 0.0;
  rate_change_ = 0.0;
}

void Governor::advance(double dt_s) noexcept {
  if (!moving_) return;
  seek_ramp();
  elapsed_s_ += dt_s;
  if (course_ == Course::kEven) time_s_ += rate_ * dt_s;
  if (course_ == Course::kRamp) follow_ramp();
  if (course_ == Course::kStop) follow_stop();
  time_s_ = std::min(time_s_, motion_.duration_s);
}

void Governor::follow_ramp() noexcept {
  const double beyond_s = elapsed_s_ - ramp_.duration_s;
  if (beyond_s < 0.0) {
    const double x = elapsed_s_ / ramp_.duration_s;
    rate_ = std::clamp(ramp_.rate(x), 0.0, 1.0);
    rate_change_ = ramp_.change(x);
    time_s_ = std::max(time_s_, ramp_.time_s(x));
    return;
  }
  rate_ = ramp_.to_rate;
  rate_change_ = 0.0;
  time_s_ = std::max(time_s_, ramp_.time_s(1.0)) + rate_ * beyond_s;
  course_ = Course::kEven;
}

void Governor::follow_stop() noexcept {
  const RateState now = stop_.at(motion_, elapsed_s_);
  time_s_ = std::max(time_s_, now.time_s);
  rate_ = std::clamp(now.rate, 0.0, 1.0);
  rate_change_ = now.change;
  if (elapsed_s_ >= stop_.duration_s()) hold();
}

double Governor::heading_for() const noexcept {
  if (course_ == Course::kStop) return 0.0;
  return course_ == Course::kRamp ? ramp_.to_rate : rate_;
}

void Governor::seek_ramp() noexcept {
  if (target_ == 0.0 && motion_.count != 0) return seek_stop();
  const double present = heading_for();
  if (present == target_) return;
  if (motion_.count == 0) {
    course_ = Course::kEven;
    rate_ = target_;
    rate_change_ = 0.0;
    return;
  }
  if (try_ramps_to(target_)) return;
  if (target_ > present && course_ == Course::kEven) (void)try_ramps_to(rate_ + (target_ - rate_) / 2.0);
}

/// Seeks a better stop in every cycle: laws that leave no room now may leave room a little later.
void Governor::seek_stop() noexcept {
  if (holding() || try_stops()) return;
  if (heading_for() != 0.0) (void)try_ramps_to(0.0);
}

bool Governor::try_stops() noexcept {
  const RateState now{time_s_, rate_, rate_change_};
  const double shortest_s = shortest_stop_s(motion_, now);
  if (shortest_s == 0.0) {
    hold();
    return true;
  }
  double best_s = until_rest_s();
  if (heading_for() == 0.0) best_s *= kWorthwhile;
  const double most_rate = rate_change_ > 0.0 ? 1.0 : rate_;
  int samples = kStopSamples;
  bool is_found = false;
  for (const PathStop::Turn turn : {PathStop::Turn::kAtOnce, PathStop::Turn::kStepwise}) {
    if (turn == PathStop::Turn::kStepwise && motion_.count == 1) break;
    for (const double share : kStopShares) {
      for (std::size_t i = 0; i < motion_.count && best_s > shortest_s && samples > 0; ++i) {
        PathStop stop(motion_, now, i, share);
        // Skips a stop that is too short: the slowest law would be stopped beyond its limits.
        if (stop.duration_s() < shortest_s * (1.0 - kLimitTolerance)) continue;
        if (!stop.plan(motion_, turn, {best_s, most_rate}, &samples)) continue;
        stop_ = stop;
        best_s = stop.duration_s();
        is_found = true;
      }
    }
  }
  if (!is_found) return false;
  elapsed_s_ = 0.0;
  course_ = Course::kStop;
  return true;
}

double Governor::until_rest_s() const noexcept {
  if (course_ == Course::kStop) return stop_.duration_s() - elapsed_s_;
  if (course_ == Course::kRamp && ramp_.to_rate == 0.0) return ramp_.duration_s - elapsed_s_;
  // Lasts to the motion's own end, at most.
  const double slowest = std::min(rate_, heading_for());
  return slowest > 0.0 ? (motion_.duration_s - time_s_) / slowest : std::numeric_limits<double>::infinity();
}

bool Governor::try_ramps_to(double rate) noexcept {
  Ramp ramp{rate_, rate_change_, rate, shortest_ramp_s(rate), time_s_};
  const double longest_s =
      rate == 0.0 ? std::min(longest_stop_s(), motion_.longest_ramp_s) : motion_.longest_ramp_s;
  for (int i = 0; i < kCandidates && ramp.duration_s <= longest_s; ++i, ramp.duration_s *= kLadderRatio) {
    if (!ramp.stays_within_unit() || !is_feasible(ramp)) continue;
    ramp_ = ramp;
    elapsed_s_ = 0.0;
    course_ = Course::kRamp;
    return true;
  }
  return false;
}

double Governor::shortest_ramp_s(double rate) const noexcept {
  double shortest_s = kShortestRamp_s;
  const double difference = std::abs(rate_ - rate);
  for (std::size_t i = 0; i < motion_.count; ++i) {
    const GovernedLaw& governed = motion_.laws[i];
    const double velocity = std::abs(governed.law.velocity(governed.law.segment_at(time_s_, 0), time_s_));
    // Peaks of a cubic ramp from rest to rest: 1.5 and 6 times those of an even ramp. With an initial slope
    // they may be a little lower, hence the half.
    const double slack = rate_change_ == 0.0 ? 1.0 : 0.5;
    shortest_s = std::max(shortest_s, slack * 0.75 * difference * velocity / governed.acceleration_limit);
    shortest_s = std::max(shortest_s, slack * std::sqrt(3.0 * difference * velocity / governed.jerk_limit));
  }
  return shortest_s;
}

double Governor::longest_stop_s() const noexcept {
  // A ramp that takes longer than the motion's own end would be no stop.
  const double rate = std::max(rate_, heading_for());
  return rate > 0.0 ? (motion_.duration_s - time_s_) / rate : motion_.duration_s;
}

bool Governor::is_feasible(const Ramp& ramp) const noexcept {
  std::array<std::size_t, kMaxJoints> segment{};
  std::array<LawSample, kMaxJoints> before{};
  for (std::size_t i = 0; i < motion_.count; ++i) {
    const LawSegments& law = motion_.laws[i].law;
    segment[i] = law.segment_at(time_s_, 0);
    before[i] = {law.velocity(segment[i], time_s_), law.acceleration(segment[i], time_s_)};
  }
  RateSample rate_before{ramp.rate(0.0), ramp.change(0.0), ramp.change_of_change(0.0)};
  for (int k = 1; k <= kSamples; ++k) {
    // The samples are denser towards both ends, where the rate's terms may grow faster than the room that the
    // rate makes.
    const double even = static_cast<double>(k) / kSamples;
    const double x = k < kSamples ? even * even * (3.0 - 2.0 * even) : 1.0;
    const RateSample rate{ramp.rate(x), ramp.change(x), ramp.change_of_change(x)};
    const double time_s = ramp.time_s(x);
    for (std::size_t i = 0; i < motion_.count; ++i) {
      const GovernedLaw& governed = motion_.laws[i];
      const LawSegments& law = governed.law;
      // Covers all accelerations and jerks between this sample and the last, corners included.
      Range acceleration{before[i].acceleration, before[i].acceleration};
      Range jerk{law.jerk(segment[i]), law.jerk(segment[i])};
      const std::size_t last = law.segment_at(time_s, segment[i]);
      while (segment[i] < last) {
        ++segment[i];
        acceleration.include(law.acceleration_at_begin(segment[i]));
        jerk.include(law.jerk(segment[i]));
      }
      const LawSample now{law.velocity(last, time_s), law.acceleration(last, time_s)};
      acceleration.include(now.acceleration);
      if (!keeps_limits(governed, rate_before, before[i].velocity, acceleration, jerk)) return false;
      if (!keeps_limits(governed, rate, now.velocity, acceleration, jerk)) return false;
      before[i] = now;
    }
    // Ignores what comes after the motion's end: it is not run.
    if (time_s >= motion_.duration_s) return true;
    rate_before = rate;
  }
  return true;
}

}  // namespace corbot::rt
