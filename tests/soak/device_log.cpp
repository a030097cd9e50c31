// SPDX-License-Identifier: Apache-2.0
#include "soak/device_log.h"

#include <algorithm>

#include "corbot/units.h"
#include "support/device_record.h"

namespace corbot::soak {
namespace {

constexpr std::size_t kGripper = 4;
constexpr double kCountsPerDegree = 1000.0;  // of every drive of profiles/lynx5-can.toml
constexpr double kServo_us_per_degree = 10.0;
constexpr double kNewShaft_us = 1500.0;  // where corbot-sim has the shafts at its start

}  // namespace

std::optional<std::size_t> DeviceLog::axis_of_channel(std::uint32_t channel) const {
  if (kind_ == Kind::kCounts) {
    if (channel < 1 || channel > kAxes) return std::nullopt;
    return channel - 1;
  }
  for (std::size_t i = 0; i < kGripper; ++i) {
    if (arm_.servos[i].channel == channel) return i;
  }
  return channel == arm_.gripper.channel ? std::optional(kGripper) : std::nullopt;
}

double DeviceLog::degrees(std::size_t axis, double pulse_us) const {
  if (axis == kGripper) return pulse_us / kServo_us_per_degree;
  const ServoMap& servo = arm_.servos[axis];
  return to_degrees((pulse_us - servo.zero_us) * servo.direction / servo.us_per_q);
}

void DeviceLog::read(const std::string& line) {
  const auto row = test::device_row(line);
  if (!row) return;
  const auto axis = axis_of_channel(row->channel);
  if (!axis) return;
  AxisState state;
  state.time_ns = row->time_ns;
  state.has_energy = row->has_power;
  if (kind_ == Kind::kCounts) {
    state.target_deg = row->given / kCountsPerDegree;
    state.shaft_deg = row->shaft / kCountsPerDegree;
  } else {
    state.shaft_deg = degrees(*axis, row->shaft);
    const auto& before = states_[*axis];
    state.target_deg = state.has_energy ? degrees(*axis, row->given)
                       : before.empty() ? state.shaft_deg
                                        : before.back().target_deg;
  }
  add(*axis, state);
}

void DeviceLog::add(std::size_t axis, const AxisState& state) { states_[axis].push_back(state); }

void DeviceLog::begin_life(std::int64_t time_ns) {
  for (std::size_t axis = 0; axis < kAxes; ++axis) {
    const double at_deg = kind_ == Kind::kCounts ? 0.0 : degrees(axis, kNewShaft_us);
    add(axis, {time_ns, at_deg, at_deg, false, true});
  }
}

void DeviceLog::end_life(std::int64_t time_ns) {
  for (std::size_t axis = 0; axis < kAxes; ++axis) {
    if (states_[axis].empty()) continue;
    AxisState last = states_[axis].back();
    last.time_ns = std::max(last.time_ns, time_ns);
    last.has_energy = false;
    add(axis, last);
  }
}

std::size_t DeviceLog::after(std::size_t axis, std::int64_t time_ns) const {
  const auto& states = states_[axis];
  const auto found = std::upper_bound(states.begin(), states.end(), time_ns,
                                      [](std::int64_t ns, const AxisState& s) { return ns < s.time_ns; });
  return static_cast<std::size_t>(found - states.begin());
}

const AxisState* DeviceLog::at(std::size_t axis, std::int64_t time_ns) const {
  const std::size_t next = after(axis, time_ns);
  return next == 0 ? nullptr : &states_[axis][next - 1];
}

std::size_t DeviceLog::size() const {
  std::size_t sum = 0;
  for (const auto& states : states_) sum += states.size();
  return sum;
}

void Track::add(const Cycle& cycle) {
  Tick tick;
  tick.time_ns = cycle.time_ns;
  for (std::size_t i = 0; i < 4; ++i) tick.theta_deg[i] = static_cast<float>(cycle.theta_deg[i]);
  tick.rate = static_cast<float>(cycle.rate);
  tick.is_error = cycle.state == "error";
  tick.is_unverified = cycle.is_unverified;
  tick.has_command = cycle.command != 0;
  tick.is_open = cycle.device == "open" || cycle.device == "degraded";
  ticks_.push_back(tick);
}

std::vector<Tick>::const_iterator Track::from(std::int64_t time_ns) const {
  return std::lower_bound(ticks_.begin(), ticks_.end(), time_ns,
                          [](const Tick& tick, std::int64_t ns) { return tick.time_ns < ns; });
}

std::vector<Episode> episodes(const Track& track) {
  std::vector<Episode> all;
  bool was_error = false;
  for (const Tick& tick : track.ticks()) {
    if (tick.is_error && !was_error) all.push_back({{tick.time_ns, tick.time_ns}, false});
    if (tick.is_error) all.back().end_ns = tick.time_ns;
    was_error = tick.is_error;
  }
  if (was_error) all.back().is_open = true;
  return all;
}

}  // namespace corbot::soak
