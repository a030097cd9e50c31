// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <string>

#include "corbot/arm/arm_model.h"
#include "corbot/channel/records.h"
#include "corbot/motion/command.h"
#include "rt/cycle/governor.h"

namespace corbot::test {

/// Judges how long a stop takes, and how fast the arm becomes on it. The measure is the stop that the limits
/// allow each law of the motion by itself. From its speed and acceleration the law goes at the jerk -j to -a,
/// on at -a, and at +j to rest. An acceleration of a is taken back while the speed rises by a²/2j. If one law
/// alone moves, nothing hinders that stop. Several joints have one path: a joint that just gives up its
/// acceleration at its own jerk lets the others slow down no sooner.
class StopJudge {
 public:
  struct Most {
    double duration;  ///< of the shortest stop
    double rise;      ///< of a²/2j, besides one cycle's
  };
  static constexpr Most kOneLaw{1.03, 1.003};
  /// The shortest stop is here that of a law with the acceleration that it is planned to reach.
  static constexpr Most kSeveralLaws{2.5, 5.0};
  /// Nearly all stops of several joints, by the acceleration that they have.
  static constexpr double kNearlyAll = 1.25;

  explicit StopJudge(const ArmModel& arm);

  /// A motion begins.
  void begin(const Command& command);
  /// Every snapshot, before and after the request. False, and `error` says why, when a law becomes too fast.
  bool see(const Snapshot& snapshot);
  /// Rest is asked for now; of several such requests the first counts.
  void request();
  /// No longer.
  void withdraw() { is_requested_ = false; }
  /// At rest, at the last snapshot seen. False when that took too long.
  bool rest();

  std::string error;
  double greatest_rise{0};   ///< of a law's speed, of a²/2j
  double greatest_share{0};  ///< of the shortest stop, of those that are not over in a few cycles
  int stops{0};              ///< of these
  int long_stops{0};         ///< of these beyond kNearlyAll

 private:
  [[nodiscard]] double speed(std::size_t law) const;
  [[nodiscard]] double acceleration(std::size_t law) const;
  [[nodiscard]] const Most& most() const { return motion_.count == 1 ? kOneLaw : kSeveralLaws; }

  ArmModel arm_;
  double dt_s_;
  rt::GovernedMotion motion_{};
  double time_s_{0.0};
  double rate_{0.0};
  double change_{0.0};  ///< of the rate, by real time
  bool is_requested_{false};
  int ticks_{0};
  double shortest_s_{0.0};
  double planned_s_{0.0};                   ///< with the acceleration that is planned
  std::array<double, kMaxJoints> speed_{};  ///< at the request
};

}  // namespace corbot::test
