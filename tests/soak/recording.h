// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <string>
#include <utility>
#include <vector>

#include "config/profile.h"
#include "soak/tick_limits.h"

namespace corbot::soak {

/// One executed motion, as recorded: all set-points of one command number.
struct Motion {
  std::uint64_t id{};
  std::int64_t life_ns{};  ///< when the recording began anew before it: numbers begin anew with a robot
  std::int64_t first_ns{};
  std::int64_t last_ns{};
  std::array<double, 4> start_deg{};
  std::array<double, 4> end_deg{};  ///< at rest afterwards
  std::array<double, 3> start_tcp_m{};
  std::array<double, 3> end_tcp_m{};
  Peaks peaks;
  std::vector<std::array<double, 3>> tcp_m;  ///< at every recorded set-point
  bool knows_start{};                        ///< the cycle before its first one was recorded
  bool whole{};  ///< neither its begin nor its end fell into cycles that were not recorded
};

struct Interval {
  std::int64_t begin_ns{};
  std::int64_t end_ns{};
};

/// One cycle of the task, as recorded.
struct Cycle {
  std::uint64_t cycle{};
  std::int64_t time_ns{};
  std::string state;
  std::uint64_t command{};
  double rate{};
  std::array<double, 4> theta_deg{};
  std::array<double, 3> tcp_m{};
  std::string device;  ///< its health
  bool is_unverified{};
  bool is_power_off{};
  bool is_fault_stop{};  ///< a fault slows the arm down, on its path or each joint by itself

  /// The servos have no energy: the set-point is where the device says that they are.
  [[nodiscard]] bool follows_device() const { return device == "standby" || is_power_off; }
};

/// A time without a cycle: the task was frozen, or there was none.
struct Silence : Interval {
  bool is_new_life{};  ///< another supervisor's robot came after it
};

/// Reads what `corbot record` prints, checks every set-point against the limits of the arm, and cuts the
/// recording into motions.
class Recording {
 public:
  explicit Recording(const Profile& profile) : arm_(profile.arm), ticks_(profile.arm) {}

  /// Called with every cycle, in their order.
  void tell(std::function<void(const Cycle&)> observer) { observer_ = std::move(observer); }
  /// Reads one line of the recording. A header begins anew: another recorder, after cycles without a record.
  void read(const std::string& line);

  [[nodiscard]] const std::vector<Motion>& motions() const noexcept { return motions_; }
  /// Times in which the set-point changed, whatever the command.
  [[nodiscard]] const std::vector<Interval>& moving() const noexcept { return moving_; }
  /// Times in which the arm was paused, moving or not.
  [[nodiscard]] const std::vector<Interval>& paused() const noexcept { return paused_; }
  /// Times of two periods and more without a cycle.
  [[nodiscard]] const std::vector<Silence>& silences() const noexcept { return silences_; }
  [[nodiscard]] const std::vector<std::int64_t>& lives() const noexcept { return lives_; }
  [[nodiscard]] const std::vector<std::string>& faults() const noexcept { return faults_; }
  [[nodiscard]] std::uint64_t cycles() const noexcept { return cycles_; }
  [[nodiscard]] std::uint64_t gaps() const noexcept { return gaps_; }
  /// The state of the newest cycle.
  [[nodiscard]] bool is_paused() const noexcept { return have_last_ && last_.state == "paused"; }
  [[nodiscard]] bool is_in_error() const noexcept { return have_last_ && last_.state == "error"; }
  [[nodiscard]] std::int64_t last_ns() const noexcept { return last_ns_; }

 private:
  void read_header(const std::string& line);
  bool parse(const std::string& line, Cycle& row) const;
  void check(const Cycle& row);
  void follow(const Cycle& row, bool continuous);
  void measure(const Cycle& row);
  void note_movement(const Cycle& row);
  void note_pause(const Cycle& row);
  void begin_motion(const Cycle& row, bool continuous);
  void fault(const Cycle& row, const std::string& text);

  const ArmModel arm_;
  TickLimits ticks_;
  int ticks_of_rest_{0};  ///< cycles without a command that still belong to the last motion's end
  std::vector<Motion> motions_;
  std::vector<Interval> moving_;
  std::vector<Interval> paused_;
  std::vector<Silence> silences_;
  std::vector<std::int64_t> lives_;
  std::vector<std::string> faults_;
  Cycle last_;
  Cycle held_;               ///< the newest one whose set-point is corbot's own
  std::int64_t last_ns_{0};  ///< of the last row, also of an earlier recorder
  bool have_last_{false};
  bool is_new_life_{true};
  std::function<void(const Cycle&)> observer_;
  std::size_t device_column_{0};  ///< 0: the recording has none
  std::size_t flags_column_{0};
  std::uint64_t cycles_{0};
  std::uint64_t gaps_{0};
};

}  // namespace corbot::soak
