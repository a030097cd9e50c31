// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "corbot/motion/longest_stop.h"
#include "soak/device_checks.h"

namespace corbot::soak {
namespace {

constexpr double kStill_deg = 0.3;
constexpr double kFrames_s = 0.2;         // until what the cycle has sent leaves the device
constexpr double kLeft_s = 0.5;           // for switching off, beyond [stop] ramp_s
constexpr double kThawed_s = 1.0;         // in which an emulator takes what was sent while it was frozen
constexpr double kApproach_deg_s = 45.0;  // 400 us/s of servos, and a share for the frames
constexpr double kSlow = 0.1;
constexpr std::int64_t kReaction_ns = 30'000'000;

const char* name_of(std::size_t axis) {
  static constexpr const char* kNames[] = {"joint 0", "joint 1", "joint 2", "joint 3", "the gripper"};
  return kNames[axis];
}

bool is_hold_only(const Clear& clear) {
  return clear.cause.starts_with("133 ") && clear.cause.find('\n') == std::string::npos;
}

/// Until when a person has not said anything.
std::int64_t until_ns(const DeviceEvidence& evidence, const Episode& episode) {
  const Clear* word = clear_of(evidence, episode);
  return word != nullptr ? word->begin_ns : episode.end_ns;
}

void check_no_new_energy(const DeviceEvidence& evidence, const Episode& episode, Verdict& verdict) {
  const std::int64_t end_ns = until_ns(evidence, episode);
  for (std::size_t axis = 0; axis < DeviceLog::kAxes; ++axis) {
    const auto& states = evidence.log.states(axis);
    for (std::size_t i = evidence.log.after(axis, episode.begin_ns + kReaction_ns);
         i < states.size() && states[i].time_ns < end_ns; ++i) {
      if (!states[i].has_energy || i == 0 || states[i - 1].has_energy) continue;
      // Sent before, to an emulator that had no processor meanwhile.
      const Interval meanwhile{episode.begin_ns, states[i].time_ns};
      const double late_s = covered_s(evidence.base.stalls, meanwhile);
      const double other_s = seconds(meanwhile.begin_ns, meanwhile.end_ns) - late_s;
      if (late_s > 0.0 && other_s < kFrames_s) continue;
      verdict.faults.push_back(
          fmt::format("{} ns: {} gets energy {:.3f} s after the begin of an Error, {:.3f} s before a Clear",
                      states[i].time_ns, name_of(axis), seconds(episode.begin_ns, states[i].time_ns),
                      seconds(states[i].time_ns, end_ns)));
      break;
    }
  }
}

/// When the ramp of the stop has ended for certain, and what was queued on the way to the device has left it.
std::int64_t rest_ns(const DeviceEvidence& evidence, const Episode& episode, std::int64_t end_ns) {
  std::int64_t rest =
      episode.begin_ns + nanoseconds(rate::longest_stop_s(evidence.base.profile.arm) + kFrames_s);
  for (const DeviceFault& fault : evidence.faults) {
    if (fault.what.starts_with("freeze") && overlap(fault, {episode.begin_ns, end_ns}))
      rest = std::max(rest, fault.end_ns + nanoseconds(kThawed_s));
  }
  for (const Interval& stall : evidence.base.stalls) {
    if (overlap(stall, {episode.begin_ns, rest})) rest += stall.end_ns - stall.begin_ns;
  }
  return rest;
}

void check_stillness(const DeviceEvidence& evidence, const Episode& episode, Verdict& verdict) {
  const std::int64_t end_ns = until_ns(evidence, episode);
  const std::int64_t from_ns = rest_ns(evidence, episode, end_ns);
  const bool measures = evidence.log.measures();
  for (std::size_t axis = 0; axis < DeviceLog::kAxes; ++axis) {
    const auto& states = evidence.log.states(axis);
    const AxisState* rest = evidence.log.at(axis, from_ns);
    for (std::size_t i = evidence.log.after(axis, from_ns); i < states.size() && states[i].time_ns < end_ns;
         ++i) {
      const AxisState& now = states[i];
      if (rest == nullptr || now.is_new_device || !now.has_energy) {
        rest = &now;
        continue;
      }
      const double moved_deg = measures ? now.shaft_deg - rest->shaft_deg : now.target_deg - rest->target_deg;
      if (std::abs(moved_deg) <= kStill_deg) continue;
      verdict.faults.push_back(
          fmt::format("{} ns: {} moves by {:.2f} degrees until {:.3f} s after the begin of an Error, {:.3f} "
                      "s before a Clear",
                      now.time_ns, name_of(axis), moved_deg, seconds(episode.begin_ns, now.time_ns),
                      seconds(now.time_ns, end_ns)));
      break;
    }
  }
}

/// Drives that take commands are switched off after the ramp.
void check_switched_off(const DeviceEvidence& evidence, const Episode& episode, Verdict& verdict) {
  if (!evidence.log.measures()) return;
  const Clear* word = clear_of(evidence, episode);
  if (word == nullptr || is_hold_only(*word)) return;
  std::int64_t off_ns = episode.begin_ns + nanoseconds(evidence.ramp_s + kLeft_s);
  for (const Interval& stall : evidence.base.stalls) {
    if (overlap(stall, {episode.begin_ns, off_ns})) off_ns += stall.end_ns - stall.begin_ns;
  }
  constexpr std::int64_t kBefore_ns = 3'000'000'000;
  const bool is_heard =
      std::all_of(evidence.faults.begin(), evidence.faults.end(), [&](const DeviceFault& f) {
        return f.is_heard || !overlap(f, {episode.begin_ns - kBefore_ns, word->begin_ns});
      });
  if (!is_heard || off_ns >= word->begin_ns) return;
  for (std::size_t axis = 0; axis < DeviceLog::kAxes; ++axis) {
    const AxisState* state = evidence.log.at(axis, off_ns);
    if (state != nullptr && state->has_energy)
      verdict.faults.push_back(fmt::format("{} ns: {} has energy {:.3f} s after the begin of an Error ({})",
                                           off_ns, name_of(axis), seconds(episode.begin_ns, off_ns),
                                           word->cause));
  }
}

/// From the Clear to the next motion.
void check_nothing_begins(const DeviceEvidence& evidence, const Episode& episode, const Clear& word,
                          Verdict& verdict) {
  const auto& ticks = evidence.track.ticks();
  auto tick = evidence.track.from(episode.end_ns);
  while (tick != ticks.end() && (tick->is_error || !tick->has_command)) {
    if (tick->is_error && tick->time_ns > episode.end_ns) break;  // another fault
    ++tick;
  }
  if (tick == ticks.end()) return;
  const std::int64_t end_ns = tick->time_ns;
  const bool measures = evidence.log.measures();
  for (std::size_t axis = 0; axis < DeviceLog::kAxes; ++axis) {
    const auto& states = evidence.log.states(axis);
    const AxisState* rest = evidence.log.at(axis, word.begin_ns);
    for (std::size_t i = evidence.log.after(axis, word.begin_ns);
         i < states.size() && states[i].time_ns < end_ns; ++i) {
      const AxisState& now = states[i];
      const bool is_known = rest != nullptr && !now.is_new_device && rest->has_energy && now.has_energy;
      // A servo without encoder that had been lost is brought over slowly; a drive stays where its shaft is.
      const double since_s =
          rest == nullptr ? 0.0 : std::clamp(seconds(rest->time_ns, now.time_ns), 0.02, 0.1);
      const double allowed_deg = kStill_deg + (measures ? 0.0 : since_s * kApproach_deg_s);
      const double moved_deg = rest == nullptr ? 0.0
                               : measures      ? now.shaft_deg - rest->shaft_deg
                                               : now.target_deg - rest->target_deg;
      if ((is_known || (measures && rest != nullptr && !now.is_new_device)) &&
          std::abs(moved_deg) > allowed_deg) {
        verdict.faults.push_back(fmt::format(
            "{} ns: {} moves by {:.2f} degrees within {:.3f} s after a Clear ({}), before any motion",
            now.time_ns, name_of(axis), moved_deg, seconds(word.begin_ns, now.time_ns), word.cause));
        break;
      }
      if (!measures || rest == nullptr || now.is_new_device) rest = &now;
    }
  }
}

}  // namespace

const Clear* clear_of(const DeviceEvidence& evidence, const Episode& episode) {
  constexpr std::int64_t kLate_ns = 100'000'000;
  const Clear* found = nullptr;
  for (const Clear& clear : evidence.base.clears) {
    if (clear.begin_ns <= episode.end_ns && clear.end_ns + kLate_ns >= episode.end_ns) found = &clear;
  }
  return found;
}

void check_energy(const DeviceEvidence& evidence, Verdict& verdict) {
  for (const Episode& episode : episodes(evidence.track)) {
    if (!episode.is_open && clear_of(evidence, episode) == nullptr)
      verdict.faults.push_back(fmt::format("an Error ends after {:.3f} s, and nobody has cleared it",
                                           seconds(episode.begin_ns, episode.end_ns)));
    check_no_new_energy(evidence, episode, verdict);
    check_stillness(evidence, episode, verdict);
    check_switched_off(evidence, episode, verdict);
  }
}

void check_return(const DeviceEvidence& evidence, Verdict& verdict) {
  const std::int64_t rest_ns = nanoseconds(rate::longest_stop_s(evidence.base.profile.arm) + kFrames_s);
  const auto& ticks = evidence.track.ticks();
  for (const Episode& episode : episodes(evidence.track)) {
    const Clear* word = clear_of(evidence, episode);
    if (word == nullptr || episode.is_open) continue;
    check_nothing_begins(evidence, episode, *word, verdict);
    const auto first = evidence.track.from(episode.end_ns + 1);
    const bool was_off = !is_hold_only(*word) && word->begin_ns - episode.begin_ns > rest_ns;
    if (was_off && !evidence.log.measures() && first != ticks.end() && !first->is_error &&
        !first->is_unverified)
      verdict.faults.push_back(
          fmt::format("{} ns: the position counts as verified after a Clear of '{}', and nothing measures it",
                      word->end_ns, word->cause));
  }
  for (const Tick& tick : ticks) {
    if (!tick.is_unverified || !tick.has_command || tick.rate <= kSlow + 1e-4f) continue;
    verdict.faults.push_back(
        fmt::format("a motion runs at {:.3f} of its speed while the position is unverified", tick.rate));
    break;
  }
}

}  // namespace corbot::soak
