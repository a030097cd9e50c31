// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <algorithm>

#include "corbot/motion/longest_stop.h"
#include "soak/checks.h"

namespace corbot::soak {
namespace {

/// Between the end of a lease and its stop, on one machine with nothing broken.
constexpr std::int64_t kExpiry_ns = 300'000'000;

/// The time in which one client has control for certain, and the time when it has lost it for certain.
struct Held {
  const Call* acquire;
  std::int64_t sure_until_ns;
  std::int64_t over_ns;  ///< 0: not known
  bool released;
};

bool is_of(const Call& call, const Call& acquire) {
  return call.client == acquire.client && call.key == acquire.number;
}

Held follow(const Evidence& evidence, const Call& acquire) {
  const std::int64_t lease_ns = nanoseconds(acquire.where[0]);
  Held held{&acquire, acquire.begin_ns + lease_ns, acquire.end_ns + lease_ns, false};
  bool is_open = false;
  for (const Call& call : evidence.ledger.calls()) {
    if (!is_of(call, acquire) || !call.needs_control()) continue;
    is_open = is_open || !call.answered();
    if (call.operation == "Release") {
      held.sure_until_ns = std::min(held.sure_until_ns, call.begin_ns);
      held.released = held.released || call.accepted();
      continue;
    }
    // It does not run out during a call.
    if (call.accepted() && call.begin_ns < held.sure_until_ns)
      held.sure_until_ns = std::max(held.sure_until_ns, call.begin_ns + lease_ns);
    if (call.begin_ns < held.over_ns) held.over_ns = std::max(held.over_ns, call.end_ns + lease_ns);
  }
  held.sure_until_ns = std::min(held.sure_until_ns, next_death_ns(evidence, acquire.begin_ns));
  if (is_open) held.over_ns = 0;
  return held;
}

void check_others(const Evidence& evidence, const Owners& owners, const Held& held, Verdict& verdict) {
  const Call& acquire = *held.acquire;
  for (const Motion& motion : evidence.recording.motions()) {
    const Call* call = owners.of(motion);
    if (call == nullptr || motion.first_ns <= acquire.end_ns || motion.first_ns >= held.sure_until_ns)
      continue;
    if (!is_of(*call, acquire))
      verdict.faults.push_back(fmt::format("{} of {} began while {} had control", describe(motion),
                                           describe(*call), describe(acquire)));
  }
  for (const Call& call : evidence.ledger.calls()) {
    if (!call.accepted() || call.begin_ns < acquire.end_ns || call.end_ns > held.sure_until_ns) continue;
    const bool is_reserved = call.needs_control() || call.operation == "Acquire";
    if (is_reserved && &call != &acquire && !is_of(call, acquire))
      verdict.faults.push_back(fmt::format("{} while {} had control", describe(call), describe(acquire)));
  }
}

void check_expiry(const Evidence& evidence, const Owners& owners, const Held& held, Verdict& verdict) {
  const Call& acquire = *held.acquire;
  const std::int64_t rest_ns =
      held.over_ns + kExpiry_ns + nanoseconds(rate::longest_stop_s(evidence.profile.arm));
  if (held.over_ns == 0 || held.released || rest_ns > evidence.recording.last_ns()) return;
  if (evidence.is_disturbed({acquire.begin_ns, rest_ns}, {"servant", "supervisor", "task"})) return;
  ++verdict.expired;
  for (const Motion& motion : evidence.recording.motions()) {
    const Call* call = owners.of(motion);
    if (call != nullptr && is_of(*call, acquire) && motion.last_ns > rest_ns)
      verdict.faults.push_back(fmt::format("{} moves {:.3f} s after the lease of {} ran out",
                                           describe(motion), seconds(held.over_ns, motion.last_ns),
                                           describe(acquire)));
  }
  for (const Call& call : evidence.ledger.calls()) {
    if (is_of(call, acquire) && call.needs_control() && call.accepted() &&
        call.begin_ns > held.over_ns + kExpiry_ns)
      verdict.faults.push_back(fmt::format("{} was accepted {:.3f} s after the lease of {} ran out",
                                           describe(call), seconds(held.over_ns, call.begin_ns),
                                           describe(acquire)));
  }
}

}  // namespace

void check_control(const Evidence& evidence, const Owners& owners, Verdict& verdict) {
  for (const Call& call : evidence.ledger.calls()) {
    if (call.operation != "Acquire" || !call.accepted()) continue;
    const Held held = follow(evidence, call);
    check_others(evidence, owners, held, verdict);
    check_expiry(evidence, owners, held, verdict);
  }
}

}  // namespace corbot::soak
