// SPDX-License-Identifier: Apache-2.0
#include "soak/verdict.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "soak/checks.h"
#include "soak/signature.h"

namespace corbot::soak {
namespace {

/// The call that this motion carried out to its end. Signatures alone would not do: a sum of some is another
/// one's.
const Call* find_by_end(const Motion& motion, const Ledger& ledger) {
  if (!motion.whole) return nullptr;
  // The gripper's: it ends where the motion before it did.
  if (motion.start_deg == motion.end_deg && motion.start_tcp_m == motion.end_tcp_m) return nullptr;
  std::vector<std::int64_t> marks{signature_of_metres(motion.end_tcp_m[1]),
                                  signature_of_degrees(motion.end_deg[0])};
  for (std::size_t i = 0; i < 4; ++i)
    marks.push_back(signature_of_degrees(std::abs(motion.end_deg[i] - motion.start_deg[i])));
  for (const std::int64_t mark : marks) {
    const Call* call = mark > 0 ? ledger.with_signature(mark, motion.first_ns) : nullptr;
    if (call != nullptr && ends_as(motion, *call)) return call;
  }
  return nullptr;
}

/// Could a motion that was stopped on the way be of this call, to which no number was given? By time alone.
bool may_be_of(const Motion& motion, const Call& call) {
  if (!call.moves() || call.begin_ns > motion.first_ns || call.begin_ns < motion.life_ns) return false;
  const bool is_open = !call.answered() || call.outcome.ends_with("/2");
  if (!call.waits_for_motion()) return is_open;
  // Its caller waited; what went wrong with the wait says nothing of the motion.
  return is_open || call.outcome == "NotReady" || call.end_ns >= motion.first_ns;
}

/// It was refused before anything moved.
bool was_refused(const Call& call) {
  if (!call.answered() || call.outcome == "ok" || call.outcome == "Stopped" || call.outcome.ends_with("/2"))
    return false;
  return !call.waits_for_motion() || call.outcome != "NotReady";
}

/// The motions of each call: MoveC has two, the line to its first point before the arc.
class CarriedOut {
 public:
  /// False: it had its motion.
  bool add(const Call& call, const Motion& motion) {
    std::set<std::uint64_t>& ids = ids_[&call];
    ids.insert(motion.id);
    return ids.size() == 1 || (call.is_arc() && ids.size() == 2 && *ids.begin() + 1 == *ids.rbegin());
  }
  [[nodiscard]] bool can_have(const Call& call, const Motion& motion) const {
    const auto found = ids_.find(&call);
    if (found == ids_.end()) return true;
    return call.is_arc() && found->second.size() == 1 && *found->second.begin() + 1 == motion.id;
  }
  [[nodiscard]] std::uint64_t first(const Call& call) const { return *ids_.at(&call).begin(); }

 private:
  std::map<const Call*, std::set<std::uint64_t>> ids_;
};

void check_done(const Evidence& evidence, const std::set<const Call*>& done, const Call& call,
                Verdict& verdict) {
  if (!call.waits_for_motion() || !call.accepted() || done.count(&call) != 0) return;
  // Were all of its cycles recorded?
  const auto& lives = evidence.recording.lives();
  const bool recorded = call.end_ns < evidence.recording.last_ns() &&
                        std::none_of(lives.begin(), lives.end(), [&](std::int64_t life_ns) {
                          return life_ns >= call.begin_ns && life_ns <= call.end_ns;
                        });
  if (recorded) verdict.faults.push_back(fmt::format("{} was not carried out to its end", describe(call)));
}

}  // namespace

std::string describe(const Motion& motion) {
  std::string text = fmt::format("command {}{}, by", motion.id, motion.whole ? "" : " (not recorded whole)");
  for (std::size_t i = 0; i < 4; ++i) text += fmt::format(" {:.6f}", motion.end_deg[i] - motion.start_deg[i]);
  return text + fmt::format(" degrees in {:.3f} s", seconds(motion.first_ns, motion.last_ns));
}

std::string describe(const Call& call) {
  return fmt::format(
      "client {} call {} {} (signature {}, {} s)", call.client, call.number, call.operation, call.signature,
      call.answered()
          ? fmt::format("answered '{}' after {:.3f}", call.outcome, seconds(call.begin_ns, call.end_ns))
          : "not answered");
}

Owners::Owners(const Evidence& evidence) : evidence_(evidence) {
  for (const Call& call : evidence.ledger.calls()) {
    if (!call.accepted() || call.ticket == 0 || !call.moves()) continue;
    by_number_.emplace(call.ticket, &call);
    if (call.is_arc()) by_number_.emplace(call.ticket - 1, &call);
  }
  for (const Motion& motion : evidence.recording.motions()) {
    by_end_.push_back(find_by_end(motion, evidence.ledger));
    by_ticket_.push_back(find_by_ticket(motion));
  }
}

/// A MoveC from its first point has no line, and the number before its own is another's.
const Call* Owners::find_by_ticket(const Motion& motion) const {
  const Call* owner = nullptr;
  const auto [first, last] = by_number_.equal_range(motion.id);
  for (auto found = first; found != last; ++found) {
    const Call* call = found->second;
    if (call->begin_ns < motion.life_ns || call->begin_ns > motion.first_ns) continue;
    if (owner == nullptr || call->ticket == motion.id) owner = call;
  }
  return owner;
}

std::size_t Owners::index(const Motion& motion) const {
  return static_cast<std::size_t>(&motion - evidence_.recording.motions().data());
}

void check_callers(const Evidence& evidence, const Owners& owners, Verdict& verdict) {
  const auto& calls = evidence.ledger.calls();
  CarriedOut carried_out;
  CarriedOut to_the_end;
  std::set<const Call*> done;
  for (const Motion& motion : evidence.recording.motions()) {
    ++verdict.motions;
    const Call* call = owners.by_end(motion);
    const Call* ticket = owners.by_ticket(motion);
    if (call != nullptr) {
      ++verdict.whole_motions;
      if (!is_line_to_arc(motion, *call)) done.insert(call);
      (void)carried_out.add(*call, motion);
      if (!to_the_end.add(*call, motion))
        verdict.faults.push_back(fmt::format("{} was carried out twice, as command {} and as {}",
                                             describe(*call), to_the_end.first(*call), describe(motion)));
      if (was_refused(*call))
        verdict.faults.push_back(
            fmt::format("{} was refused, and carried out by {}", describe(*call), describe(motion)));
      if (ticket != nullptr && call != ticket)
        verdict.faults.push_back(fmt::format("{} was accepted as {}, which carried out {}", describe(*ticket),
                                             describe(motion), describe(*call)));
    } else if (ticket != nullptr) {
      (void)carried_out.add(*ticket, motion);
    } else if (motion.whole) {
      // Stopped on the way: of a caller that was not given its number.
      const auto caller = std::find_if(calls.begin(), calls.end(), [&](const Call& c) {
        return may_be_of(motion, c) && carried_out.can_have(c, motion);
      });
      if (caller == calls.end())
        verdict.faults.push_back(fmt::format("{}: nobody called for it", describe(motion)));
      else
        (void)carried_out.add(*caller, motion);
    }
  }
  for (const Call& call : calls) check_done(evidence, done, call, verdict);
}

void check_limits(const Evidence& evidence, const Owners& owners, Verdict& verdict) {
  const TickLimits limits(evidence.profile.arm);
  for (const Motion& motion : evidence.recording.motions()) {
    const Call* call = owners.of(motion);
    const bool on_path = call != nullptr && (call->is_line() || call->is_arc());
    const char* const kind = call == nullptr                 ? "unknown, stopped on the way"
                             : !on_path                      ? "joints"
                             : call->is_line()               ? "line"
                             : is_line_to_arc(motion, *call) ? "line to an arc"
                                                             : "arc";
    ++verdict.motions_by_kind[kind];
    std::string fault = on_path ? limits.tool_fault(motion.peaks) : limits.joint_fault(motion.peaks);
    // The caller of a motion that was stopped on the way is unknown, and so is whether the motion was a line.
    if (call == nullptr && !fault.empty() && limits.tool_fault(motion.peaks).empty()) fault.clear();
    if (fault.empty() && call != nullptr) {
      fault = path_fault(motion, *call);
      if (on_path && motion.knows_start) ++verdict.paths;
    }
    if (!fault.empty()) verdict.faults.push_back(fmt::format("{} ({}): {}", describe(motion), kind, fault));
  }
}

Verdict judge(const Evidence& evidence) {
  Verdict verdict;
  verdict.faults = evidence.recording.faults();
  const Owners owners(evidence);
  check_callers(evidence, owners, verdict);
  check_limits(evidence, owners, verdict);
  check_answers(evidence, owners, verdict);
  check_stops(evidence, owners, verdict);
  check_cancels(evidence, owners, verdict);
  check_control(evidence, owners, verdict);
  check_states(evidence, verdict);
  check_clears(evidence, verdict);
  return verdict;
}

}  // namespace corbot::soak
