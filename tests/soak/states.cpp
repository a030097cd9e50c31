// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <algorithm>
#include <sstream>

#include "soak/checks.h"

namespace corbot::soak {
namespace {

constexpr std::int64_t kStateNoticed_ns = 500'000'000;  // of a task that stands still
/// The time in which a running supervisor starts a killed task, beyond the back-off that it announces. The
/// supervisor notices the death at once. The task is ready when it has read the profile and taken over the
/// segment.
constexpr double kStart_s = 1.0;
/// The soak reads an announcement that late: between two looks there may be a `corbot status`.
constexpr std::int64_t kRead_ns = 2'500'000'000;
constexpr std::int64_t kStateRecent_ns = 20'000'000'000;

double unexplained_s(const Evidence& evidence, const Silence& silence) {
  std::vector<Interval> explained = evidence.stalls;
  for (const Break& b : evidence.breaks) {
    if (b.what == "freeze task" || b.what == "freeze supervisor") explained.push_back(b);
  }
  double left_s = seconds(silence.begin_ns, silence.end_ns) - covered_s(explained, silence);
  for (const Restart& restart : evidence.restarts) {
    if (restart.seen_ns >= silence.begin_ns && restart.seen_ns <= silence.end_ns + kRead_ns)
      left_s -= restart.back_off_s;
  }
  return left_s;
}

/// Between two cycles of one task, so it is longer than `gap_fault_ms` for its own task: no restart.
bool is_gap(const Evidence& evidence, const Silence& silence) {
  constexpr std::int64_t kGap_ns = 90'000'000;
  constexpr std::int64_t kJustBefore_ns = 200'000'000;
  if (silence.is_new_life || silence.end_ns - silence.begin_ns < kGap_ns) return false;
  return std::none_of(evidence.breaks.begin(), evidence.breaks.end(), [&](const Break& b) {
    return (b.what == "kill task" || b.what == "kill supervisor") &&
           overlap({b.begin_ns, b.begin_ns}, {silence.begin_ns - kJustBefore_ns, silence.end_ns});
  });
}

}  // namespace

void check_states(const Evidence& evidence, Verdict& verdict) {
  for (const Silence& silence : evidence.recording.silences()) {
    if (silence.end_ns - silence.begin_ns < kStateNoticed_ns) continue;
    for (const Call& call : evidence.ledger.calls()) {
      if (call.operation != "Status" || (call.outcome != "Waiting" && call.outcome != "Standby")) continue;
      if (call.begin_ns < silence.begin_ns + kStateNoticed_ns || call.end_ns > silence.end_ns) continue;
      verdict.faults.push_back(
          fmt::format("client {} was told '{}' when the task had been silent for {:.3f} s", call.client,
                      call.outcome, seconds(silence.begin_ns, call.begin_ns)));
    }
    if (silence.is_new_life) continue;
    const double left_s = unexplained_s(evidence, silence);
    verdict.longest_silence_s = std::max(verdict.longest_silence_s, left_s);
    if (left_s > kStart_s)
      verdict.faults.push_back(
          fmt::format("no cycle for {:.3f} s, of which nothing explains {:.3f} s, allowed {} s",
                      seconds(silence.begin_ns, silence.end_ns), left_s, kStart_s));
  }
}

void check_clears(const Evidence& evidence, Verdict& verdict) {
  std::int64_t last_ns = 0;
  for (const Clear& clear : evidence.clears) {
    if (!clear.done) continue;
    const Interval recent{std::max(last_ns, clear.begin_ns - kStateRecent_ns), clear.end_ns};
    const auto was_broken = [&](const char* what) {
      return std::any_of(evidence.breaks.begin(), evidence.breaks.end(),
                         [&](const Break& b) { return b.what == what && overlap(b, recent); });
    };
    const auto& calls = evidence.ledger.calls();
    const auto& silences = evidence.recording.silences();
    const bool was_held = std::any_of(calls.begin(), calls.end(), [&](const Call& c) {
      return c.operation == "StopAndHold" && c.begin_ns <= clear.end_ns &&
             (!c.answered() || c.end_ns >= last_ns);
    });
    const bool stood_still = std::any_of(silences.begin(), silences.end(), [&](const Silence& s) {
      return overlap(s, recent) && is_gap(evidence, s);
    });
    std::string why = was_held && clear.cause.find("133 ") != std::string::npos ? "StopAndHold"
                      : was_broken("freeze task")                               ? "freeze task"
                      : stood_still                                             ? "the machine stood still"
                      : was_held                                                ? "StopAndHold"
                                                                                : "";
    std::string codes;
    std::istringstream alarms(clear.cause);
    for (std::string alarm; std::getline(alarms, alarm);) {
      const std::string code = alarm.substr(0, alarm.find(' '));
      if (codes.find(code) == std::string::npos) codes += (codes.empty() ? "" : "+") + code;
    }
    if (why.empty()) {
      why = "nothing";
      for (const Break& b : evidence.breaks) {
        if (b.begin_ns <= clear.end_ns) why = b.what;
      }
      verdict.faults.push_back(
          fmt::format("cleared '{}' after {}: no cycle was late, nobody held the arm", clear.cause, why));
    }
    ++verdict.clears[fmt::format("alarm {}, after {}", codes, why)];
    last_ns = clear.end_ns;
  }
}

}  // namespace corbot::soak
