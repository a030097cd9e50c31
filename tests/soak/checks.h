// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <map>
#include <string>
#include <vector>

#include "soak/evidence.h"
#include "soak/verdict.h"

// What the judge looks at, one function a question. Each adds what it finds to the verdict.

namespace corbot::soak {

/// Whose motion is which.
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
  std::vector<const Call*> by_ticket_;  // likewise
};

[[nodiscard]] std::string describe(const Motion& motion);
[[nodiscard]] std::string describe(const Call& call);

/// MoveC from elsewhere goes to its first point in a line.
[[nodiscard]] bool is_line_to_arc(const Motion& motion, const Call& call);
/// Does the motion end where this call wanted it to?
[[nodiscard]] bool ends_as(const Motion& motion, const Call& call);
/// "" or how the set-points leave what this call asked for: the straight line, the arc, the one joint, and each way only once.
[[nodiscard]] std::string path_fault(const Motion& motion, const Call& call);

/// No motion without a caller, none twice, none that was refused; all of one whose caller was told that it is done.
void check_callers(const Evidence& evidence, const Owners& owners, Verdict& verdict);
/// At every tick: joints' and tool's limits, and the path.
void check_limits(const Evidence& evidence, const Owners& owners, Verdict& verdict);
/// Every caller is answered within the bound of his call.
void check_answers(const Evidence& evidence, const Owners& owners, Verdict& verdict);
/// Nothing moves after a stop that had reached the servant before it; nothing at all while the arm is held or paused.
void check_stops(const Evidence& evidence, const Owners& owners, Verdict& verdict);
/// What was taken back does not move.
void check_cancels(const Evidence& evidence, const Owners& owners, Verdict& verdict);
/// Nobody else moves the arm of a holder, and nothing of his moves when his lease has run out.
void check_control(const Evidence& evidence, const Owners& owners, Verdict& verdict);
/// While no cycle runs, or the arm is held, nobody is told that it is well; and cycles run again in time.
void check_states(const Evidence& evidence, Verdict& verdict);
/// A person is needed only for what is documented.
void check_clears(const Evidence& evidence, Verdict& verdict);

}  // namespace corbot::soak
