// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

namespace corbot::sim {

/// The positions of an axis' switches, in counts of the shaft itself, independent of the drive's count. The
/// home switch is active from its position upwards, a limit switch beyond its position.
struct AxisSwitches {
  double home{10'000.0};
  double negative{-1e6};
  double positive{1e6};
};

/// The homing objects 6098h, 6099h and 609Ah.
struct HomingOptions {
  int method{0};
  double search_counts_per_s{5'000.0};
  double creep_counts_per_s{1'000.0};
  double counts_per_s2{50'000.0};
};

/// Homing after CiA 402-2: methods 17 and 18 (limit switches), 19 and 20 (home switch), 35 and 37 (at the
/// shaft's position). It searches the switch, then creeps back over its edge.
class HomingSequence {
 public:
  enum class State { kNotStarted, kSearch, kCreep, kInterrupted, kAttained, kError };

  [[nodiscard]] static bool has_method(int method);

  void start(const HomingOptions& options);
  void interrupt();
  /// Keeps the state attained, by an earlier homing.
  void keep() { state_ = State::kAttained; }
  void forget() { state_ = State::kNotStarted; }
  /// Returns the next speed of the shaft at `shaft`. If the state is then attained, the shaft is at the home
  /// position.
  [[nodiscard]] double next_speed(const AxisSwitches& switches, double shaft);

  [[nodiscard]] State state() const { return state_; }
  [[nodiscard]] bool is_running() const { return state_ == State::kSearch || state_ == State::kCreep; }
  [[nodiscard]] const HomingOptions& options() const { return options_; }

 private:
  HomingOptions options_{};
  State state_{State::kNotStarted};
};

}  // namespace corbot::sim
