// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <string>

#include "corbot/arm/arm_model.h"
#include "corbot/channel/records.h"
#include "corbot/motion/command.h"

namespace corbot::test {

/// Greatest shares of a limit that were seen; 1 = the limit itself.
struct Shares {
  double speed{0}, acceleration{0}, jerk{0};
};

/// Looks at every set-point by itself, from outside: by difference quotients, not by what the cycle says of
/// itself.
///
/// Tolerances, relative to the limits: 1e-6 on what a plan alone does, 1e-5 while the rate changes (the
/// governor looks at samples). Absolute, for rounding: a set-point of some radians
/// carries 1e-15, hence a third difference over 1 ms carries 8e-15 / 1e-9 s³, taken as 1e-4.
class Watcher {
 public:
  Watcher(const ArmModel& arm, const Snapshot& at_rest);

  /// From here on the set-points belong to this command.
  void begin(const Command& command);
  /// One cycle. False, and `error` says what broke, when a limit is broken or the path is left.
  bool see(const Snapshot& snapshot);

  /// The state may be Error from here on: a fault is slowing the arm down, within the same limits.
  void expect_fault() { expects_fault_ = true; }

  std::string error;
  Shares joint;     ///< of joint motions
  Shares path;      ///< of lines and arcs
  Shares rotation;  ///< of the tool on these, where the arm follows every orientation
  double deviation_m{0};

 private:
  static constexpr std::size_t kHistory = 4;
  bool see_range(const Snapshot& snapshot);
  bool see_joint(std::size_t joint);
  bool see_path();
  bool see_turn();
  bool see_deviation(const Snapshot& snapshot);
  bool fail(const std::string& what, double value, double bound);

  ArmModel arm_;
  double dt_s_;
  Command command_{};
  bool has_command_{false};
  bool ramped_{false};
  bool expects_fault_{false};
  double last_rate_{-1.0};
  std::array<Joints, kHistory> q_{};                 ///< newest first
  std::array<std::array<double, 3>, kHistory> p_{};  ///< TCP, newest first
  std::array<Quaternion, 2> orientation_{};          ///< of the tool, newest first
  std::array<double, 3> turn_{};                     ///< of the tool in a cycle, rad, newest first
  int path_age_{0};                                  ///< set-points since the line or arc began
};

}  // namespace corbot::test
