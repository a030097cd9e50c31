// SPDX-License-Identifier: Apache-2.0
#include "soak/verdict.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>
#include <set>

#include "soak/signature.h"

namespace corbot::soak {
namespace {

constexpr double kAnswer_s = 5.0;      // of a call that does not wait for a motion, on a busy machine
constexpr double kMotion_s = 30.0;     // of one that does: a full queue before it
constexpr double kDisturbed_s = 60.0;  // whatever was broken meanwhile
constexpr std::int64_t kNoticed_ns = 500'000'000;  // of a task that stands still

double seconds(std::int64_t from_ns, std::int64_t to_ns) {
  return static_cast<double>(to_ns - from_ns) * 1e-9;
}

bool is_disturbed(const Call& call, const std::vector<Disturbance>& disturbances) {
  return std::any_of(disturbances.begin(), disturbances.end(), [&](const Disturbance& d) {
    return call.begin_ns <= d.end_ns && call.end_ns >= d.begin_ns;
  });
}

/// Does the motion end where this call wanted it to? Signatures alone would not do: a sum of some is another one's.
bool is_of(const Motion& motion, const Call& call) {
  constexpr double kNear_deg = 0.2 * kStep_deg;
  constexpr double kNear_m = 0.2 * kStep_m;
  if (call.operation == "StartMoveS") {
    for (std::size_t i = 0; i < 3; ++i) {
      if (std::abs(motion.end_tcp_m[i] - call.where[i]) > kNear_m) return false;
    }
    return true;
  }
  for (std::size_t i = 0; i < 4; ++i) {
    const bool drives = call.operation != "StartMoveJoints";
    const double by_deg = static_cast<double>(i) == call.where[0] ? call.where[1] : 0.0;
    const double end_deg = drives ? motion.start_deg[i] + by_deg : call.where[i];
    if (std::abs(motion.end_deg[i] - end_deg) > kNear_deg) return false;
  }
  return true;
}

/// A motion for a reader: how far each joint went, and how surely it ended.
std::string describe(const Motion& motion) {
  std::string text = fmt::format("command {}{}, by", motion.id, motion.whole ? "" : " (not recorded whole)");
  for (std::size_t i = 0; i < 4; ++i) text += fmt::format(" {:.6f}", motion.end_deg[i] - motion.start_deg[i]);
  return text + fmt::format(" degrees in {:.3f} s", seconds(motion.first_ns, motion.last_ns));
}

std::string describe(const Call& call) {
  return fmt::format("client {} call {} {} (signature {}, answered '{}' after {:.3f} s)", call.client,
                     call.number, call.operation, call.signature, call.outcome,
                     seconds(call.begin_ns, call.end_ns));
}

/// The call that this motion carried out to its end; none for one that was stopped on the way.
const Call* call_of(const Motion& motion, const Ledger& ledger) {
  std::vector<std::int64_t> marks{signature_of_metres(motion.end_tcp_m[1]),
                                  signature_of_degrees(motion.end_deg[0])};
  for (std::size_t i = 0; i < 4; ++i)
    marks.push_back(signature_of_degrees(std::abs(motion.end_deg[i] - motion.start_deg[i])));
  for (const std::int64_t mark : marks) {
    const Call* call = mark > 0 ? ledger.with_signature(mark, motion.first_ns) : nullptr;
    if (call != nullptr && is_of(motion, *call)) return call;
  }
  return nullptr;
}

/// Could a motion that was stopped on the way be of this call, to which no number was given? By time alone.
bool may_be_of(const Motion& motion, const Call& call) {
  if (!call.moves() || call.begin_ns > motion.first_ns || call.begin_ns < motion.life_ns) return false;
  const bool is_open = !call.answered() || call.outcome.ends_with("/2");
  if (call.operation != "Drive") return is_open;
  // Its caller waited; what went wrong with the wait says nothing of the motion.
  return is_open || call.outcome == "NotReady" || call.end_ns >= motion.first_ns;
}

void check_answers(const Ledger& ledger, const std::vector<Disturbance>& disturbances, Verdict& verdict) {
  for (const Call& call : ledger.calls()) {
    ++verdict.calls;
    if (!call.answered()) {
      ++verdict.unanswered;
      continue;
    }
    const double took_s = seconds(call.begin_ns, call.end_ns);
    const bool disturbed = is_disturbed(call, disturbances);
    const bool waits = call.operation == "Drive" || call.operation == "Wait";
    const double bound_s = disturbed ? kDisturbed_s : waits ? kMotion_s : kAnswer_s;
    verdict.slowest_s = std::max(verdict.slowest_s, took_s);
    if (!disturbed && !waits) verdict.slowest_undisturbed_s = std::max(verdict.slowest_undisturbed_s, took_s);
    if (took_s > bound_s)
      verdict.faults.push_back(fmt::format("client {} call {} {}: answered '{}' after {:.1f} s, bound {} s",
                                           call.client, call.number, call.operation, call.outcome, took_s,
                                           bound_s));
  }
}

/// Accepted calls by their ticket, which is the number of their command.
class Tickets {
 public:
  explicit Tickets(const Ledger& ledger) {
    for (const Call& call : ledger.calls()) {
      if (call.accepted() && call.ticket != 0 && call.moves()) calls_.emplace(call.ticket, &call);
    }
  }
  /// Null when no caller was given this number in this life of the robot.
  [[nodiscard]] const Call* of(const Motion& motion) const {
    const auto [first, last] = calls_.equal_range(motion.id);
    for (auto found = first; found != last; ++found) {
      if (found->second->begin_ns >= motion.life_ns && found->second->begin_ns <= motion.first_ns)
        return found->second;
    }
    return nullptr;
  }

 private:
  std::multimap<std::uint64_t, const Call*> calls_;
};

void check_callers(const Profile& profile, const Ledger& ledger, const Recording& recording,
                   Verdict& verdict) {
  std::map<const Call*, const Motion*> carried_out;
  std::set<const Call*> used;
  const Tickets tickets(ledger);
  for (const Motion& motion : recording.motions()) {
    ++verdict.motions;
    const Call* call = motion.whole ? call_of(motion, ledger) : nullptr;
    if (call != nullptr) {
      ++verdict.whole_motions;
      const auto [first, is_first] = carried_out.emplace(call, &motion);
      if (!is_first && first->second->id != motion.id)
        verdict.faults.push_back(fmt::format("{} was carried out twice, as command {} and as {}",
                                             describe(*call), first->second->id, describe(motion)));
      if (call->answered() && call->outcome != "ok" && call->outcome != "Stopped" &&
          !call->outcome.ends_with("/2") && call->operation != "Drive")
        verdict.faults.push_back(
            fmt::format("{} was refused, and carried out by {}", describe(*call), describe(motion)));
      if (call->operation == "StartMoveS" &&
          motion.worst_tool_m_s > profile.arm.path.speed_m_s * (1.0 + 1e-5) + 1e-6)
        verdict.faults.push_back(
            fmt::format("command {}: the tool at {} m/s on a line", motion.id, motion.worst_tool_m_s));
    }
    const Call* ticket = tickets.of(motion);
    if (ticket != nullptr && call != nullptr && call != ticket)
      verdict.faults.push_back(fmt::format("{} was accepted as {}, which carried out {}", describe(*ticket),
                                           describe(motion), describe(*call)));
    if (call != nullptr) used.insert(call);
    if (ticket != nullptr) used.insert(ticket);
    if (ticket == nullptr && call == nullptr && motion.whole) {
      // Stopped on the way: of a caller that was not given its number. Each call has one motion.
      const auto caller = std::find_if(ledger.calls().begin(), ledger.calls().end(), [&](const Call& c) {
        return may_be_of(motion, c) && used.count(&c) == 0;
      });
      if (caller == ledger.calls().end())
        verdict.faults.push_back(fmt::format("{}: nobody called for it", describe(motion)));
      else
        used.insert(&*caller);
    }
  }
}

void check_stops(const Ledger& ledger, const Recording& recording, Verdict& verdict) {
  const Tickets tickets(ledger);
  for (const Call& stop : ledger.calls()) {
    if (stop.operation != "Stop" || !stop.accepted()) continue;
    for (const Motion& motion : recording.motions()) {
      if (motion.last_ns <= stop.end_ns) continue;
      const Call* call = tickets.of(motion);
      const bool was_accepted = call != nullptr && call->end_ns < stop.begin_ns;
      if (!was_accepted && motion.first_ns >= stop.begin_ns) continue;
      verdict.faults.push_back(fmt::format(
          "command {} was accepted, or moved, before client {}'s Stop and moves {:.3f} s after it", motion.id,
          stop.client, seconds(stop.end_ns, motion.last_ns)));
    }
  }
}

/// While no cycle runs, nobody is told that the arm is well.
void check_states(const Ledger& ledger, const Recording& recording, Verdict& verdict) {
  for (const Call& call : ledger.calls()) {
    if (call.operation != "Status" || (call.outcome != "Waiting" && call.outcome != "Standby")) continue;
    for (const Silence& silence : recording.silences()) {
      if (call.begin_ns < silence.begin_ns + kNoticed_ns || call.end_ns > silence.end_ns) continue;
      verdict.faults.push_back(
          fmt::format("client {} was told '{}' when the task had been silent for {:.3f} s", call.client,
                      call.outcome, seconds(silence.begin_ns, call.begin_ns)));
    }
  }
}

/// A person is needed only after a time in which nobody watched the arm: its task was frozen, or the machine stood still.
void check_clears(const Recording& recording, const std::vector<Disturbance>& disturbances,
                  const std::vector<Clear>& clears, Verdict& verdict) {
  constexpr std::int64_t kBefore_ns = 10'000'000'000;
  for (const Clear& clear : clears) {
    const auto is_recent = [&](std::int64_t begin_ns, std::int64_t end_ns) {
      return begin_ns <= clear.time_ns && end_ns >= clear.time_ns - kBefore_ns;
    };
    std::string after = "nothing";
    for (const Disturbance& d : disturbances) {
      if (d.begin_ns <= clear.time_ns) after = d.what;
    }
    const bool was_frozen = std::any_of(disturbances.begin(), disturbances.end(), [&](const Disturbance& d) {
      return d.what.find("freeze task") != std::string::npos && is_recent(d.begin_ns, d.end_ns);
    });
    const bool stood_still =
        std::any_of(recording.pauses().begin(), recording.pauses().end(),
                    [&](const Silence& pause) { return is_recent(pause.begin_ns, pause.end_ns); });
    ++verdict.clears[fmt::format("{}, after {}", clear.cause.substr(0, clear.cause.find(" for ")),
                                 was_frozen ? "freeze task" : after)];
    if (!was_frozen && !stood_still)
      verdict.faults.push_back(fmt::format("cleared '{}' after {}: no cycle was late", clear.cause, after));
  }
}

}  // namespace

Verdict judge(const Profile& profile, const Ledger& ledger, const Recording& recording,
              const std::vector<Disturbance>& disturbances, const std::vector<Clear>& clears) {
  Verdict verdict;
  verdict.faults = recording.faults();
  check_answers(ledger, disturbances, verdict);
  check_callers(profile, ledger, recording, verdict);
  check_stops(ledger, recording, verdict);
  check_states(ledger, recording, verdict);
  check_clears(recording, disturbances, clears, verdict);
  return verdict;
}

}  // namespace corbot::soak
