// SPDX-License-Identifier: Apache-2.0
#include "sim/devices/cia402_drive.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

namespace corbot::sim {
namespace {

using State = Cia402Drive::State;

constexpr std::int64_t kDriveStep_ns = 250'000;
constexpr std::uint16_t kSwitchOnBit = 1u << 0;
constexpr std::uint16_t kVoltageBit = 1u << 1;
constexpr std::uint16_t kNoQuickStopBit = 1u << 2;
constexpr std::uint16_t kEnableBit = 1u << 3;
constexpr std::uint16_t kStartHomingBit = 1u << 4;
constexpr std::uint16_t kResetBit = 1u << 7;
constexpr std::uint16_t kHaltBit = 1u << 8;

constexpr std::uint16_t kStatusVoltage = 1u << 4;
constexpr std::uint16_t kStatusWarning = 1u << 7;
constexpr std::uint16_t kStatusRemote = 1u << 9;
constexpr std::uint16_t kStatusReached = 1u << 10;
constexpr std::uint16_t kStatusLimit = 1u << 11;
constexpr std::uint16_t kStatusFollows = 1u << 12;
constexpr std::uint16_t kStatusAttained = 1u << 12;
constexpr std::uint16_t kStatusFollowingError = 1u << 13;
constexpr std::uint16_t kStatusHomingError = 1u << 13;
/// The value of 6065h that switches off the monitoring of following errors.
constexpr double kNoWindow = 4294967295.0;

std::int32_t counts(double value) {
  return static_cast<std::int32_t>(std::lround(std::clamp<double>(
      value, std::numeric_limits<std::int32_t>::min(), std::numeric_limits<std::int32_t>::max())));
}

}  // namespace

Cia402Drive::Cia402Drive(const Cia402DriveOptions& options)
    : options_(options),
      lowest_(std::numeric_limits<std::int32_t>::min()),
      highest_(std::numeric_limits<std::int32_t>::max()),
      target_(options.position),
      demand_(options.position),
      position_(options.position) {}

std::int32_t Cia402Drive::position() const { return counts(position_); }
std::int32_t Cia402Drive::demand() const { return counts(demand_); }

bool Cia402Drive::has_power() const {
  return state_ == State::kOperationEnabled || state_ == State::kQuickStopActive ||
         state_ == State::kFaultReactionActive;
}

std::uint16_t Cia402Drive::statusword() const {
  auto word = static_cast<unsigned>(state_) | kStatusRemote;
  if (!is_sto_) word |= kStatusVoltage;
  if (has_warning_) word |= kStatusWarning;
  if (is_limited_ || is_pressing()) word |= kStatusLimit;
  if (mode_ == kModeHoming) {
    if (!homing_.is_running() && speed_ == 0.0) word |= kStatusReached;
    if (homing_.state() == HomingSequence::State::kAttained) word |= kStatusAttained;
    if (homing_.state() == HomingSequence::State::kError) word |= kStatusHomingError;
  } else {
    const bool follows = state_ == State::kOperationEnabled && mode_ == kModeCyclicPosition;
    if (follows && !is_ignoring_) word |= kStatusFollows;
    if (error_code_ == kFollowingError) word |= kStatusFollowingError;
  }
  return static_cast<std::uint16_t>(word);
}

void Cia402Drive::set_limits(std::int32_t lowest, std::int32_t highest) {
  lowest_ = lowest;
  highest_ = highest;
}

void Cia402Drive::set_following(double window, double timeout_s) {
  options_.following_window = window;
  options_.following_timeout_s = timeout_s;
}

void Cia402Drive::set_mode(int mode) {
  if (mode_ == mode) return;
  homing_.interrupt();
  mode_ = mode;
  hold_here();
  if (mode == kModeCyclicPosition) set_target(target_);
}

void Cia402Drive::set_piece(std::optional<std::int32_t> count) {
  piece_ = count;
  is_above_piece_ = count && position_ >= *count;
}

void Cia402Drive::move_shaft(double count) {
  if (is_blocked_) return;
  position_ = !piece_ ? count : is_above_piece_ ? std::max(count, *piece_) : std::min(count, *piece_);
}

bool Cia402Drive::is_pressing() const {
  return piece_ && has_power() && position_ == *piece_ &&
         (is_above_piece_ ? demand_ < position_ : demand_ > position_);
}

void Cia402Drive::hold_here() {
  demand_ = position_;
  speed_ = 0.0;
  left_s_ = 0.0;
}

void Cia402Drive::set_target(std::int32_t target) {
  target_ = lowest_ <= highest_ ? std::clamp(target, lowest_, highest_) : target;
  is_limited_ = target_ != target;
  if (state_ != State::kOperationEnabled || mode_ != kModeCyclicPosition || is_ignoring_) return;
  left_s_ = std::max(interpolation_s_, 1e-6);
  speed_ = (target_ - demand_) / left_s_;
}

void Cia402Drive::set_ignoring(bool is_on) {
  is_ignoring_ = is_on;
  if (mode_ == kModeCyclicPosition && has_power()) hold_here();
}

void Cia402Drive::leave_operation() {
  if (state_ == State::kOperationEnabled) enter(State::kSwitchOnDisabled);
}

bool Cia402Drive::turn(double counts) {
  if (has_power()) return false;
  position_ += counts;
  return true;
}

void Cia402Drive::enter(State state) {
  const bool had_power = has_power();
  state_ = state;
  if (state != State::kOperationEnabled) homing_.interrupt();
  if (has_power() == had_power) return;
  hold_here();  // the stage was off, or is off now
  following_s_ = 0.0;
  if (state == State::kOperationEnabled) set_target(target_);
}

void Cia402Drive::control_homing(std::uint16_t before) {
  const bool is_asked = (controlword_ & kStartHomingBit) != 0;
  if (!is_asked || (controlword_ & kHaltBit) != 0) return homing_.interrupt();
  if ((before & kStartHomingBit) == 0) homing_.start(homing_options_);
}

void Cia402Drive::control(std::uint16_t controlword) {
  const bool is_reset = (controlword & kResetBit) != 0 && (controlword_ & kResetBit) == 0;
  const std::uint16_t before = std::exchange(controlword_, controlword);
  const bool has_voltage = (controlword & kVoltageBit) != 0;
  const bool quick_stop = has_voltage && (controlword & kNoQuickStopBit) == 0;
  const bool switch_on = has_voltage && !quick_stop && (controlword & kSwitchOnBit) != 0;
  const bool enable = switch_on && (controlword & kEnableBit) != 0;
  switch (state_) {
    case State::kSwitchOnDisabled:
      if (has_voltage && !quick_stop && !switch_on && !is_sto_) enter(State::kReadyToSwitchOn);
      break;
    case State::kReadyToSwitchOn:
    case State::kSwitchedOn:
      if (!has_voltage || quick_stop) {
        enter(State::kSwitchOnDisabled);
      } else if (!switch_on) {
        enter(State::kReadyToSwitchOn);
      } else {
        enter(enable && state_ == State::kSwitchedOn ? State::kOperationEnabled : State::kSwitchedOn);
      }
      break;
    case State::kOperationEnabled:
      if (!has_voltage || (quick_stop && quick_stop_option_ == 0)) {
        enter(State::kSwitchOnDisabled);
      } else if (quick_stop) {
        enter(State::kQuickStopActive);
      } else if (!enable) {
        enter(switch_on ? State::kSwitchedOn : State::kReadyToSwitchOn);
      } else if (mode_ == kModeHoming) {
        control_homing(before);
      }
      break;
    case State::kQuickStopActive:
      if (!has_voltage) enter(State::kSwitchOnDisabled);
      break;
    case State::kFault:
      if (is_reset) {
        error_code_ = 0;
        enter(State::kSwitchOnDisabled);
      }
      break;
    default:
      break;
  }
}

void Cia402Drive::set_sto(bool is_on) {
  is_sto_ = is_on;
  if (is_on && state_ != State::kFault) enter(State::kSwitchOnDisabled);
}

void Cia402Drive::fail(std::uint16_t code) {
  if (state_ == State::kFault || state_ == State::kFaultReactionActive) return;
  error_code_ = code;
  enter(has_power() ? State::kFaultReactionActive : State::kFault);
}

void Cia402Drive::power_cycle(bool counts_from_0) {
  if (counts_from_0) {
    count_0_ += position_;
    position_ = 0.0;
    homing_.forget();
  } else {
    homing_.interrupt();
  }
  state_ = State::kSwitchOnDisabled;
  controlword_ = 0;
  error_code_ = 0;
  mode_ = 0;
  target_ = position();
  demand_ = position_;
  speed_ = 0.0;
  left_s_ = 0.0;
  is_limited_ = has_warning_ = false;
}

void Cia402Drive::advance(std::int64_t now_ns) {
  if (now_ns_ == 0 || !has_power()) now_ns_ = std::max(now_ns_, now_ns);
  // A drive at rest stays so, however long ago its last update was.
  if (now_ns - now_ns_ > 1'000'000'000 && speed_ == 0.0 && left_s_ <= 0.0 && !homing_.is_running()) {
    move_shaft(demand_);
    now_ns_ = now_ns - kDriveStep_ns;
  }
  while (now_ns_ < now_ns) {
    const std::int64_t step_ns = std::min(kDriveStep_ns, now_ns - now_ns_);
    step(static_cast<double>(step_ns) * 1e-9);
    now_ns_ += step_ns;
  }
}

void Cia402Drive::step(double dt_s) {
  if (!has_power()) return;
  if (state_ == State::kOperationEnabled) {
    if (mode_ == kModeHoming) {
      step_homing(dt_s);
    } else {
      step_demand(dt_s);
    }
  } else {
    step_ramp(dt_s);
  }
  const double share = options_.lag_s > 0.0 ? -std::expm1(-dt_s / options_.lag_s) : 1.0;
  const double most = options_.most_counts_per_s * dt_s;
  move_shaft(position_ + std::clamp(share * (demand_ - position_), -most, most));
  if (state_ == State::kOperationEnabled) watch_following(dt_s);
}

void Cia402Drive::step_demand(double dt_s) {
  if (left_s_ <= 0.0) {
    speed_ = 0.0;
    return;
  }
  left_s_ -= dt_s;
  demand_ = left_s_ > 1e-9 ? demand_ + speed_ * dt_s : target_;
}

void Cia402Drive::step_homing(double dt_s) {
  const bool was_running = homing_.is_running();
  const double wanted = homing_.next_speed(switches_, count_0_ + position_);
  if (was_running && homing_.state() == HomingSequence::State::kAttained) {
    count_0_ += position_ - home_offset_;
    position_ = home_offset_;
    return hold_here();
  }
  const double most = homing_.options().counts_per_s2 * dt_s;
  speed_ += std::clamp(wanted - speed_, -most, most);
  demand_ += speed_ * dt_s;
}

void Cia402Drive::step_ramp(double dt_s) {
  const double slower = std::abs(speed_) - options_.quick_stop_counts_per_s2 * dt_s;
  speed_ = std::copysign(std::max(slower, 0.0), speed_);
  demand_ += speed_ * dt_s;
  if (speed_ != 0.0) return;
  if (state_ == State::kFaultReactionActive) {
    enter(State::kFault);
  } else if (quick_stop_option_ != 6) {
    enter(State::kSwitchOnDisabled);
  }
}

void Cia402Drive::watch_following(double dt_s) {
  const double window = options_.following_window;
  const bool is_outside = window < kNoWindow && std::abs(demand_ - position_) > window;
  following_s_ = is_outside ? following_s_ + dt_s : 0.0;
  if (following_s_ > options_.following_timeout_s) fail(kFollowingError);
}

}  // namespace corbot::sim
