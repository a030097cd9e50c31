// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <algorithm>

#include "corbot/motion/longest_stop.h"
#include "soak/checks.h"

namespace corbot::soak {
namespace {

// The longest times that a call may take by its contract, while nothing is broken and the machine runs.
constexpr double kAtOnce_s = 0.5;       // also NotReady to whom waits for a task that is frozen or gone
constexpr double kPlan_s = 2.0;         // until it is known where the arm will rest
constexpr double kReportsRead_s = 1.0;  // after a Stop, of what it has ended
constexpr double kAdmitted_s = 15.0;    // Acquire, for calls of others that were admitted before
constexpr double kCommand_s = 5.0;      // each of the two ways of `corbot stop` (--timeout)

struct Bound {
  double s;
  bool by_cycles;  ///< what is waited for takes cycles of the task
};

Bound bound_of(const Call& call, const ArmModel& arm) {
  if (call.client == kByCommand) return {2.0 * kCommand_s + kAtOnce_s, true};
  if (call.stops() || call.operation == "Cancel")
    return {rate::longest_stop_s(arm) + kReportsRead_s + kAtOnce_s, true};
  if (call.operation == "Acquire") return {kPlan_s + kAdmitted_s + kAtOnce_s, true};
  if (call.moves())
    return {kPlan_s + kAtOnce_s, true};  // of one that waits: each time in which nothing moves
  if (call.operation == "Wait") return {call.where[0] + kAtOnce_s, false};
  return {kAtOnce_s, call.operation == "Pause" || call.operation == "Resume"};
}

/// Times that count for no bound: what kept this call, its caller or the machine from going on.
std::vector<Interval> excuses(const Evidence& evidence, const Call& call, bool by_cycles) {
  const Interval within{call.begin_ns, call.end_ns};
  std::vector<Interval> all;
  for (const Break& b : evidence.breaks) {
    const bool concerns = b.what == "freeze servant" ||
                          (b.what == "freeze client" && b.client == call.client) ||
                          (b.what == "half-open connections" && is_relayed(call.client));
    if (concerns && overlap(b, within)) all.push_back(b);
  }
  for (const Interval& stall : evidence.stalls) {
    if (overlap(stall, within)) all.push_back(stall);
  }
  if (by_cycles) {
    const std::vector<Interval> lost = lost_cycles(evidence, within);
    all.insert(all.end(), lost.begin(), lost.end());
  }
  // A call that waits for its turn also waits while the arm is paused, whichever client has paused it.
  for (const Interval& pause : evidence.recording.paused()) {
    if (call.waits_for_motion() && overlap(pause, within)) all.push_back(pause);
  }
  return all;
}

double counted_s(const std::vector<Interval>& excused, const Interval& time) {
  return seconds(time.begin_ns, time.end_ns) - covered_s(excused, time);
}

/// The longest time within the call in which no command ran. `motions`: by time.
double longest_idle_s(const Evidence& evidence, const Call& call, const std::vector<Interval>& excused) {
  const auto& motions = evidence.recording.motions();
  auto motion = std::lower_bound(motions.begin(), motions.end(), call.begin_ns,
                                 [](const Motion& m, std::int64_t ns) { return m.last_ns < ns; });
  double longest_s = 0.0;
  std::int64_t since_ns = call.begin_ns;
  for (; motion != motions.end() && motion->first_ns < call.end_ns; ++motion) {
    if (motion->first_ns > since_ns)
      longest_s = std::max(longest_s, counted_s(excused, {since_ns, motion->first_ns}));
    since_ns = std::max(since_ns, motion->last_ns);
  }
  return since_ns < call.end_ns ? std::max(longest_s, counted_s(excused, {since_ns, call.end_ns}))
                                : longest_s;
}

}  // namespace

void check_answers(const Evidence& evidence, const Owners& owners, Verdict& verdict) {
  for (const Call& call : evidence.ledger.calls()) {
    Verdict::Answers& answers = verdict.answers[call.operation];
    ++answers.calls;
    if (call.answered()) ++answers.outcomes[call.outcome];
    if (!call.answered()) {
      ++answers.unanswered;
      continue;
    }
    const Bound bound = bound_of(call, evidence.profile.arm);
    const std::vector<Interval> excused = excuses(evidence, call, bound.by_cycles);
    const double took_s = call.waits_for_motion() ? longest_idle_s(evidence, call, excused)
                                                  : counted_s(excused, {call.begin_ns, call.end_ns});
    answers.longest_s = std::max(answers.longest_s, seconds(call.begin_ns, call.end_ns));
    answers.longest_counted_s = std::max(answers.longest_counted_s, took_s);
    answers.bound_s = std::max(answers.bound_s, bound.s);
    if (took_s > bound.s)
      verdict.faults.push_back(
          fmt::format("{}: {:.3f} s of it count, bound {:.3f} s", describe(call), took_s, bound.s));
  }
  for (const Motion& motion : evidence.recording.motions()) {
    const Call* call = owners.by_end(motion);
    if (call == nullptr || !call->accepted() || !call->waits_for_motion() || is_line_to_arc(motion, *call))
      continue;
    const double late_s =
        counted_s(excuses(evidence, *call, true), {std::min(motion.last_ns, call->end_ns), call->end_ns});
    if (late_s > kAtOnce_s)
      verdict.faults.push_back(
          fmt::format("{} was answered {:.3f} s after its motion had ended", describe(*call), late_s));
  }
}

}  // namespace corbot::soak
