// SPDX-License-Identifier: Apache-2.0
#include "sim/devices/homing_sequence.h"

namespace corbot::sim {
namespace {

enum class Switch { kNone, kHome, kNegative, kPositive };

/// Searches in a direction until the switch is active, or is inactive, and creeps back until this has ended.
struct Method {
  Switch where;
  int search;  ///< +1 or -1
  bool until_active;
};

Method method_of(int number) {
  switch (number) {
    case 17:
      return {Switch::kNegative, -1, true};
    case 18:
      return {Switch::kPositive, 1, true};
    case 19:
      return {Switch::kHome, 1, true};
    case 20:
      return {Switch::kHome, -1, false};
    default:
      return {Switch::kNone, 0, false};
  }
}

bool is_active(Switch which, const AxisSwitches& switches, double shaft) {
  switch (which) {
    case Switch::kHome:
      return shaft >= switches.home;
    case Switch::kNegative:
      return shaft <= switches.negative;
    case Switch::kPositive:
      return shaft >= switches.positive;
    default:
      return false;
  }
}

}  // namespace

bool HomingSequence::has_method(int method) {
  return (method >= 17 && method <= 20) || method == 35 || method == 37;
}

void HomingSequence::start(const HomingOptions& options) {
  options_ = options;
  state_ = has_method(options.method) ? State::kSearch : State::kError;
}

void HomingSequence::interrupt() {
  if (is_running()) state_ = State::kInterrupted;
}

double HomingSequence::next_speed(const AxisSwitches& switches, double shaft) {
  const Method method = method_of(options_.method);
  if (state_ == State::kSearch && method.where == Switch::kNone) state_ = State::kAttained;
  if (!is_running()) return 0.0;
  const bool active = is_active(method.where, switches, shaft);
  if (state_ == State::kSearch) {
    if (active == method.until_active) {
      state_ = State::kCreep;
    } else if (is_active(method.search > 0 ? Switch::kPositive : Switch::kNegative, switches, shaft)) {
      state_ = State::kError;  // the axis has ended before the switch
      return 0.0;
    } else {
      return method.search * options_.search_counts_per_s;
    }
  }
  if (active != method.until_active) {
    state_ = State::kAttained;
    return 0.0;
  }
  return -method.search * options_.creep_counts_per_s;
}

}  // namespace corbot::sim
