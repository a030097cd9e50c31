// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <map>
#include <string>
#include <vector>

#include "soak/evidence.h"
#include "soak/verdict.h"

// The judge's checks, one function each. Each adds its findings to the verdict.

namespace corbot::soak {

/// Finds the call that a motion belongs to.
class Owners {
 public:
  explicit Owners(const Evidence& evidence);

  /// By the number that the caller was given; null when no caller was given it in this life of the robot.
  [[nodiscard]] const Call* by_ticket(const Motion& motion) const { return by_ticket_[index(motion)]; }
  /// By where it ended; null for one that was stopped on the way.
  [[nodiscard]] const Call* by_end(const Motion& motion) const { return by_end_[index(motion)]; }
  [[nodiscard]] const Call* of(const Motion& motion) const {
    const Call* call = by_end(motion);
    return call != nullptr ? call : by_ticket(motion);
  }

 private:
  [[nodiscard]] const Call* find_by_ticket(const Motion& motion) const;
  [[nodiscard]] std::size_t index(const Motion& motion) const;

  const Evidence& evidence_;
  std::multimap<std::uint64_t, const Call*> by_number_;
  std::vector<const Call*> by_end_;     // a motion each
  std::vector<const Call*> by_ticket_;  // a motion each
};

[[nodiscard]] std::string describe(const Motion& motion);
[[nodiscard]] std::string describe(const Call& call);

/// MoveC from elsewhere goes to its first point in a line.
[[nodiscard]] bool is_line_to_arc(const Motion& motion, const Call& call);
/// Does the motion end where this call wanted it to?
[[nodiscard]] bool ends_as(const Motion& motion, const Call& call);
/// "" or how the set-points leave what this call asked for: the straight line, the arc, the one joint, and
/// each way only once.
[[nodiscard]] std::string path_fault(const Motion& motion, const Call& call);

/// Checks that no motion is without a caller, runs twice or was refused, and that a motion reported as done
/// is complete.
void check_callers(const Evidence& evidence, const Owners& owners, Verdict& verdict);
/// Checks joints' and tool's limits, and the path, at every tick.
void check_limits(const Evidence& evidence, const Owners& owners, Verdict& verdict);
/// Checks that every call ends within its bound.
void check_answers(const Evidence& evidence, const Owners& owners, Verdict& verdict);
/// Checks that no motion runs if a stop had reached the servant before it, or while the arm is held or
/// paused.
void check_stops(const Evidence& evidence, const Owners& owners, Verdict& verdict);
/// Checks that no cancelled motion moves the arm.
void check_cancels(const Evidence& evidence, const Owners& owners, Verdict& verdict);
/// Checks that only the holder of exclusive control moves the arm, and not after the lease has run out.
void check_control(const Evidence& evidence, const Owners& owners, Verdict& verdict);
/// Checks that no client gets a good state while no cycle runs or the arm is held, and that cycles run again
/// in time.
void check_states(const Evidence& evidence, Verdict& verdict);
/// Checks that only documented causes need a person's Clear.
void check_clears(const Evidence& evidence, Verdict& verdict);

}  // namespace corbot::soak
