// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <initializer_list>
#include <string>
#include <string_view>
#include <vector>

#include "config/profile.h"
#include "soak/ledger.h"
#include "soak/recording.h"

namespace corbot::soak {

/// One thing that was broken on purpose, until it was undone; CLOCK_MONOTONIC, as all times here.
struct Break : Interval {
  std::string what;  ///< "freeze client"
  int client{};      ///< which one, where it was one of them
};

/// A Clear that a person would have had to give. The robot may have carried out a part of a refused one.
struct Clear : Interval {
  std::string cause;  ///< the active alarms that do not pass by themselves, one a line
  bool done{true};
};

/// The supervisor has announced when it starts a process again.
struct Restart {
  std::int64_t seen_ns{};  ///< when the soak read it
  double back_off_s{};
};

/// All that a run leaves for the judge.
struct Evidence {
  const Profile& profile;
  const Ledger& ledger;
  const Recording& recording;
  std::vector<Break> breaks{};
  std::vector<Interval> stalls{};  ///< in which the machine stood still: a thread that sleeps found it so
  std::vector<Clear> clears{};
  std::vector<Restart> restarts{};

  /// Returns true if a break with one of these words was in this time or in the two seconds before, or if the
  /// machine stalled. Among breaks of clients only those of `client` count.
  [[nodiscard]] bool is_disturbed(const Interval& time, std::initializer_list<const char*> words,
                                  int client = 0) const;
};

[[nodiscard]] constexpr double seconds(std::int64_t from_ns, std::int64_t to_ns) {
  return static_cast<double>(to_ns - from_ns) * 1e-9;
}
[[nodiscard]] constexpr std::int64_t nanoseconds(double seconds) {
  return static_cast<std::int64_t>(seconds * 1e9);
}
[[nodiscard]] constexpr bool overlap(const Interval& a, const Interval& b) {
  return a.begin_ns <= b.end_ns && b.begin_ns <= a.end_ns;
}
/// How much of `within` these intervals cover, each instant once.
[[nodiscard]] double covered_s(std::vector<Interval> intervals, const Interval& within);

/// Returns the stalls of the loop without another report: gaps that are no fault, and the first part of
/// longer gaps. A longer gap counts until the servant's answers say that the task is frozen or gone.
[[nodiscard]] std::vector<Interval> lost_cycles(const Evidence& evidence, const Interval& within);

/// When the robot's processes were all killed, and what they kept in memory was lost: the first time after
/// that instant.
[[nodiscard]] std::int64_t next_death_ns(const Evidence& evidence, std::int64_t after_ns);

}  // namespace corbot::soak
