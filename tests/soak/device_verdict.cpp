// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <sstream>

#include "soak/checks.h"
#include "soak/device_checks.h"
#include "soak/tick_limits.h"

namespace corbot::soak {
namespace {

constexpr double kPulse_deg = 0.25;    // a controller's whole microseconds, and the next motion's first ones
constexpr double kMeasured_deg = 0.3;  // between the measurement and this instant
constexpr double kDeviceFrames_s = 0.06;  // two frames of the servos and the bus
constexpr double kEnabling_s = 6.0;       // in which drives must have been enabled, one after another
constexpr std::int64_t kRecent_ns = 30'000'000'000;

bool has_code(const std::string& cause, std::initializer_list<const char*> codes) {
  std::istringstream alarms(cause);
  for (std::string alarm; std::getline(alarms, alarm);) {
    if (std::any_of(codes.begin(), codes.end(), [&](const char* code) { return alarm.starts_with(code); }))
      return true;
  }
  return false;
}

/// The Error that ended this motion, or began right after it.
const Episode* error_of(const std::vector<Episode>& all, const Motion& motion) {
  constexpr std::int64_t kAfter_ns = 50'000'000;
  for (const Episode& episode : all) {
    if (episode.begin_ns >= motion.first_ns && episode.begin_ns <= motion.last_ns + kAfter_ns)
      return &episode;
  }
  return nullptr;
}

/// No ramp is possible: device lost, gap, replaced or gone task.
bool may_cut(const DeviceEvidence& evidence, const Episode& episode) {
  const Clear* word = clear_of(evidence, episode);
  return word == nullptr || has_code(word->cause, {"121 ", "131 ", "141 ", "142 ", "150 ", "153 "});
}

bool reaches(const DeviceEvidence& evidence, std::size_t axis, double goal_deg, const Interval& time) {
  const bool measures = evidence.log.measures();
  const double allowed_deg = measures ? evidence.goal_deg[axis] + kMeasured_deg : kPulse_deg;
  const auto is_there = [&](const AxisState& state) {
    return state.has_energy &&
           std::abs((measures ? state.shaft_deg : state.target_deg) - goal_deg) <= allowed_deg;
  };
  const AxisState* at = evidence.log.at(axis, time.begin_ns);
  if (at == nullptr || is_there(*at)) return true;
  const auto& states = evidence.log.states(axis);
  for (std::size_t i = evidence.log.after(axis, time.begin_ns);
       i < states.size() && states[i].time_ns <= time.end_ns; ++i) {
    if (is_there(states[i])) return true;
  }
  return false;
}

/// A device behind a terminal's buffer that does not take what is sent: no write can tell.
bool is_unknowable(const DeviceEvidence& evidence, const Interval& time) {
  constexpr std::int64_t kBefore_ns = 500'000'000;
  const Interval around{time.begin_ns - kBefore_ns, time.end_ns};
  return std::any_of(evidence.faults.begin(), evidence.faults.end(),
                     [&](const DeviceFault& f) {
                       const bool hides =
                           f.what.find("emulator") != std::string::npos || f.what.starts_with("drop");
                       return hides && !evidence.log.measures() && overlap(f, around);
                     }) ||
         std::any_of(evidence.base.stalls.begin(), evidence.base.stalls.end(),
                     [&](const Interval& s) { return overlap(s, around); });
}

bool explains(const DeviceFault& fault, const std::string& alarm) {
  return std::any_of(fault.alarms.begin(), fault.alarms.end(),
                     [&](const std::string& code) { return alarm.starts_with(code); });
}

void check_cause(const DeviceEvidence& evidence, const Clear& clear, const std::string& alarm,
                 std::int64_t since_ns, Verdict& verdict) {
  const Interval recent{since_ns, clear.end_ns};
  const bool is_fault =
      std::any_of(evidence.faults.begin(), evidence.faults.end(),
                  [&](const DeviceFault& f) { return overlap(f, recent) && explains(f, alarm); });
  const bool is_stall =
      has_code(alarm, {"121 ", "130 emergency stop: the device does not say", "131 ", "141 ", "142 "}) &&
      std::any_of(evidence.base.stalls.begin(), evidence.base.stalls.end(),
                  [&](const Interval& s) { return overlap(s, recent); });
  const auto& calls = evidence.base.ledger.calls();
  const bool is_hold =
      alarm.starts_with("133 ") && std::any_of(calls.begin(), calls.end(), [&](const Call& c) {
        return c.operation == "StopAndHold" && c.begin_ns <= clear.end_ns &&
               (!c.answered() || c.end_ns >= since_ns);
      });
  if (!is_fault && !is_stall && !is_hold)
    verdict.faults.push_back(
        fmt::format("a Clear was needed for '{}', and nothing that was broken explains it", alarm));
}

void check_shown(const DeviceEvidence& evidence, const DeviceFault& fault, Verdict& verdict) {
  if (fault.error_within_s <= 0.0) return;
  const auto& ticks = evidence.track.ticks();
  const auto first = evidence.track.from(fault.begin_ns);
  std::int64_t due_ns = fault.begin_ns + nanoseconds(fault.error_within_s);
  // A device that is about to open has that time besides.
  if (first != ticks.end() && !first->is_open && !first->is_error) due_ns += nanoseconds(kEnabling_s);
  due_ns += nanoseconds(covered_s(evidence.base.stalls, {fault.begin_ns, due_ns}));
  if (fault.end_ns < due_ns) return;
  const auto last = evidence.track.from(due_ns);
  if (last == ticks.end() || last->time_ns > fault.end_ns + kRecent_ns) return;  // no cycle ran
  if (std::none_of(first, last + 1, [](const Tick& tick) { return tick.is_error; })) {
    verdict.faults.push_back(fmt::format("no Error within {:.2f} s of '{}', which lasted {:.2f} s",
                                         seconds(fault.begin_ns, due_ns), fault.what,
                                         seconds(fault.begin_ns, fault.end_ns)));
    return;
  }
  if (fault.name.empty()) return;
  for (const Clear& clear : evidence.base.clears) {
    if (!clear.done || clear.begin_ns < fault.begin_ns) continue;
    if (clear.cause.find(fault.name) == std::string::npos)
      verdict.faults.push_back(
          fmt::format("'{}' was cleared after '{}', which is not named", clear.cause, fault.what));
    return;
  }
}

}  // namespace

void check_success(const DeviceEvidence& evidence, Verdict& verdict) {
  const Owners owners(evidence.base);
  for (const Motion& motion : evidence.base.recording.motions()) {
    const Call* call = owners.by_end(motion);
    if (call == nullptr || !call->waits_for_motion() || !call->accepted() || is_line_to_arc(motion, *call))
      continue;
    const Interval time{motion.last_ns,
                        std::max(call->end_ns, motion.last_ns) + nanoseconds(kDeviceFrames_s)};
    if (is_unknowable(evidence, time)) continue;
    for (std::size_t axis = 0; axis < 4; ++axis) {
      if (reaches(evidence, axis, motion.end_deg[axis], time)) continue;
      const AxisState* at = evidence.log.at(axis, time.begin_ns);
      verdict.faults.push_back(
          fmt::format("{} ns: {} was told to be done, and joint {} is {:.2f} degrees from its end{}",
                      call->end_ns, describe(*call), axis,
                      (evidence.log.measures() ? at->shaft_deg : at->target_deg) - motion.end_deg[axis],
                      at->has_energy ? "" : ", without energy"));
      break;
    }
  }
}

void check_ramps(const DeviceEvidence& evidence, Verdict& verdict) {
  const Owners owners(evidence.base);
  const TickLimits limits(evidence.base.profile.arm);
  const std::vector<Episode> errors = episodes(evidence.track);
  for (const Motion& motion : evidence.base.recording.motions()) {
    const Call* call = owners.of(motion);
    const bool on_path = call != nullptr && (call->is_line() || call->is_arc());
    ++verdict.motions_by_kind[call == nullptr ? "unknown" : on_path ? "line or arc" : "joints"];
    std::string fault = on_path ? limits.tool_fault(motion.peaks) : limits.joint_fault(motion.peaks);
    if (call == nullptr && !fault.empty() && limits.tool_fault(motion.peaks).empty()) fault.clear();
    const Episode* error = error_of(errors, motion);
    if (fault.empty() || (error != nullptr && may_cut(evidence, *error))) continue;
    const Clear* word = error != nullptr ? clear_of(evidence, *error) : nullptr;
    verdict.faults.push_back(fmt::format("{}{}: {}", describe(motion),
                                         word != nullptr ? " ended by '" + word->cause + "'" : std::string(),
                                         fault));
  }
}

void check_alarms(const DeviceEvidence& evidence, Verdict& verdict) {
  for (const DeviceFault& fault : evidence.faults) check_shown(evidence, fault, verdict);
  std::int64_t last_ns = 0;
  for (const Clear& clear : evidence.base.clears) {
    if (!clear.done) continue;
    const std::int64_t since_ns = std::max(last_ns, clear.begin_ns - kRecent_ns);
    std::istringstream alarms(clear.cause);
    for (std::string alarm; std::getline(alarms, alarm);) {
      ++verdict.clears[alarm.substr(0, alarm.find(';'))];
      check_cause(evidence, clear, alarm, since_ns, verdict);
    }
    last_ns = clear.end_ns;
  }
}

Verdict judge_devices(const DeviceEvidence& evidence) {
  Verdict verdict;
  verdict.faults = evidence.base.recording.faults();
  const Owners owners(evidence.base);
  check_callers(evidence.base, owners, verdict);
  check_stops(evidence.base, owners, verdict);
  check_cancels(evidence.base, owners, verdict);
  check_control(evidence.base, owners, verdict);
  check_ramps(evidence, verdict);
  check_energy(evidence, verdict);
  check_return(evidence, verdict);
  check_success(evidence, verdict);
  check_alarms(evidence, verdict);
  return verdict;
}

}  // namespace corbot::soak
