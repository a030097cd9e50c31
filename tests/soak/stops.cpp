// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <algorithm>
#include <limits>

#include "corbot/motion/longest_stop.h"
#include "soak/checks.h"

namespace corbot::soak {
namespace {

constexpr std::int64_t kForever_ns = std::numeric_limits<std::int64_t>::max();
/// A request that a client sent as long ago has reached the servant, on one machine with nothing broken.
constexpr std::int64_t kArrived_ns = 500'000'000;
/// A hold is on disk within 100 ms.
constexpr std::int64_t kSaved_ns = 200'000'000;

/// Had the request of this motion reached the servant before the stop was counted? True where that is
/// certain.
bool is_older(const Evidence& evidence, const Motion& motion, const Call* call, const Call& stop) {
  if (motion.first_ns < stop.begin_ns) return true;
  if (call == nullptr) return false;
  if (call->answered() && call->end_ns < stop.begin_ns) return true;
  return call->begin_ns + kArrived_ns < stop.begin_ns &&
         !evidence.is_disturbed({call->begin_ns, stop.begin_ns}, {"servant", "supervisor", "connections"},
                                call->client);
}

/// The first movement after `from_ns` and before `to_ns`.
const Interval* first_movement(const Recording& recording, std::int64_t from_ns, std::int64_t to_ns) {
  for (const Interval& moving : recording.moving()) {
    if (moving.end_ns > from_ns) return moving.begin_ns < to_ns ? &moving : nullptr;
  }
  return nullptr;
}

/// Until when a hold lasts; nothing when a Clear may have come in between.
std::int64_t held_until(const Evidence& evidence, const Call& hold) {
  std::int64_t until_ns = kForever_ns;
  for (const Clear& clear : evidence.clears) {
    if (clear.end_ns >= hold.begin_ns) until_ns = std::min(until_ns, clear.begin_ns);
  }
  const std::int64_t death_ns = next_death_ns(evidence, hold.begin_ns);
  return death_ns < hold.end_ns + kSaved_ns ? std::min(until_ns, death_ns) : until_ns;
}

void check_hold(const Evidence& evidence, const Call& hold, Verdict& verdict) {
  const std::int64_t until_ns = held_until(evidence, hold);
  if (until_ns <= hold.end_ns) return;
  if (const Interval* moving = first_movement(evidence.recording, hold.end_ns, until_ns))
    verdict.faults.push_back(fmt::format("the arm moves {:.3f} s after {}, which nobody has cleared",
                                         seconds(hold.end_ns, std::max(hold.end_ns, moving->begin_ns)),
                                         describe(hold)));
  for (const Call& call : evidence.ledger.calls()) {
    if (call.operation != "Status" || call.begin_ns < hold.end_ns || call.end_ns > until_ns) continue;
    if (call.outcome == "Standby" || call.outcome == "Waiting")
      verdict.faults.push_back(fmt::format("{} while the arm is held, since {:.3f} s", describe(call),
                                           seconds(hold.end_ns, call.begin_ns)));
  }
}

void check_pause(const Evidence& evidence, const Call& pause, Verdict& verdict) {
  std::int64_t until_ns = next_death_ns(evidence, pause.begin_ns);
  for (const Call& call : evidence.ledger.calls()) {
    if (call.operation == "Resume" && (!call.answered() || call.end_ns >= pause.begin_ns))
      until_ns = std::min(until_ns, call.begin_ns);
  }
  std::int64_t rest_ns = pause.end_ns + nanoseconds(rate::longest_stop_s(evidence.profile.arm));
  rest_ns += nanoseconds(covered_s(lost_cycles(evidence, {pause.end_ns, rest_ns}), {pause.end_ns, rest_ns}));
  if (until_ns <= rest_ns) return;
  if (const Interval* moving = first_movement(evidence.recording, rest_ns, until_ns))
    verdict.faults.push_back(fmt::format("the arm moves {:.3f} s after {}, which nobody has resumed",
                                         seconds(pause.end_ns, std::max(rest_ns, moving->begin_ns)),
                                         describe(pause)));
}

}  // namespace

void check_stops(const Evidence& evidence, const Owners& owners, Verdict& verdict) {
  const auto& motions = evidence.recording.motions();
  for (const Call& call : evidence.ledger.calls()) {
    if (!call.accepted()) continue;
    if (call.operation == "Pause") check_pause(evidence, call, verdict);
    if (call.operation == "StopAndHold") check_hold(evidence, call, verdict);
    if (call.stops() || call.operation == "Cancel" || call.operation == "Pause")
      ++verdict.stops[call.operation];
    if (!call.stops()) continue;
    auto motion = std::lower_bound(motions.begin(), motions.end(), call.end_ns,
                                   [](const Motion& m, std::int64_t ns) { return m.last_ns <= ns; });
    for (; motion != motions.end(); ++motion) {
      const Call* owner = owners.of(*motion);
      if (motion->first_ns > call.end_ns + nanoseconds(60.0)) break;  // of calls that came much later
      if (is_older(evidence, *motion, owner, call))
        verdict.faults.push_back(
            fmt::format("{} was accepted, or moved, before {} and moves {:.3f} s after it", describe(*motion),
                        describe(call), seconds(call.end_ns, motion->last_ns)));
    }
  }
}

void check_cancels(const Evidence& evidence, const Owners& owners, Verdict& verdict) {
  const auto& motions = evidence.recording.motions();
  for (const Call& cancel : evidence.ledger.calls()) {
    if (cancel.operation != "Cancel" || !cancel.accepted()) continue;
    const auto ticket = static_cast<std::uint64_t>(cancel.signature);
    bool is_behind = false;  // what is queued behind one that was under way, and did not reach its end
    for (const Motion& motion : motions) {
      const Call* call = owners.by_ticket(motion);
      if (call == nullptr || call->begin_ns > cancel.begin_ns || motion.life_ns > cancel.begin_ns) continue;
      const bool is_meant = call->ticket == ticket && call->client == cancel.client;
      if (is_meant && motion.first_ns < cancel.begin_ns && motion.last_ns > cancel.begin_ns)
        is_behind = owners.by_end(motion) == nullptr;
      const bool is_taken_back = is_meant || (is_behind && call->ticket > ticket && call->answered() &&
                                              call->end_ns < cancel.begin_ns);
      if (is_taken_back && motion.last_ns > cancel.end_ns)
        verdict.faults.push_back(fmt::format("{} moves {:.3f} s after {}", describe(motion),
                                             seconds(cancel.end_ns, motion.last_ns), describe(cancel)));
    }
  }
}

}  // namespace corbot::soak
