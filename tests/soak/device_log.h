// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "soak/recording.h"

namespace corbot::soak {

/// The state of a device's axis from an instant on, in degrees of the joint, or tenths of a gripper's travel.
struct AxisState {
  std::int64_t time_ns{};
  double target_deg{};  ///< what it was given last: the pulse that it sends, the drive's target
  double shaft_deg{};
  bool has_energy{};  ///< it sends pulses; the motor has current
  /// Another device, or the same after a loss of its supply: its way to this state is unknown.
  bool is_new_device{};
};

/// The record that corbot-sim writes, by joint: 0 to 3, and the gripper.
class DeviceLog {
 public:
  static constexpr std::size_t kAxes = 5;
  enum class Kind { kPulses, kCounts };

  DeviceLog(Kind kind, const ArmModel& arm) : kind_(kind), arm_(arm) {}

  /// corbot measures the shafts of drives, too.
  [[nodiscard]] bool measures() const noexcept { return kind_ == Kind::kCounts; }
  /// One line of the record; what is no row is ignored.
  void read(const std::string& line);
  /// The program has begun, or has been killed: no axis has energy, and the shafts are where a new one has
  /// them.
  void begin_life(std::int64_t time_ns);
  void end_life(std::int64_t time_ns);

  void add(std::size_t axis, const AxisState& state);
  [[nodiscard]] const std::vector<AxisState>& states(std::size_t axis) const { return states_[axis]; }
  /// The first state after this time, as an index into states().
  [[nodiscard]] std::size_t after(std::size_t axis, std::int64_t time_ns) const;
  /// As it was at this time; null before the first.
  [[nodiscard]] const AxisState* at(std::size_t axis, std::int64_t time_ns) const;
  [[nodiscard]] std::size_t size() const;

 private:
  [[nodiscard]] std::optional<std::size_t> axis_of_channel(std::uint32_t channel) const;
  [[nodiscard]] double degrees(std::size_t axis, double pulse_us) const;

  Kind kind_;
  ArmModel arm_;
  std::array<std::vector<AxisState>, kAxes> states_;
};

/// One cycle's command, small enough to keep all of a run.
struct Tick {
  std::int64_t time_ns{};
  std::array<float, 4> theta_deg{};
  float rate{};
  bool is_error{};
  bool is_unverified{};
  bool has_command{};
  bool is_open{};  ///< the device's health: open or degraded
};

class Track {
 public:
  void add(const Cycle& cycle);
  void add(const Tick& tick) { ticks_.push_back(tick); }
  [[nodiscard]] const std::vector<Tick>& ticks() const noexcept { return ticks_; }
  /// The first at or after this time; the end when there is none.
  [[nodiscard]] std::vector<Tick>::const_iterator from(std::int64_t time_ns) const;

 private:
  std::vector<Tick> ticks_;
};

/// A time in Error, without a break by a Clear.
struct Episode : Interval {
  bool is_open{};  ///< the recording ends in it
};
[[nodiscard]] std::vector<Episode> episodes(const Track& track);

}  // namespace corbot::soak
