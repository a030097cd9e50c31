// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <algorithm>

#include "soak/evidence.h"
#include "soak/gpio_soak.h"

namespace corbot::soak {
namespace {

constexpr double kSlack_s = 0.1;  // of a thread that looks every 2 ms

bool overlaps_any(const std::vector<Interval>& all, const Interval& time) {
  return std::any_of(all.begin(), all.end(), [&](const Interval& i) { return overlap(i, time); });
}

/// As it was switched last by then.
bool is_on_at(const GpioEvents& events, std::int64_t time_ns) {
  bool is_on = false;
  for (const GpioEvents::Power& power : events.power) {
    if (power.time_ns <= time_ns) is_on = power.is_on;
  }
  return is_on;
}

}  // namespace

std::vector<std::string> judge_power(const GpioEvents& events, double ramp_s) {
  std::vector<std::string> faults;
  for (const Interval& stop : events.stops) {
    const std::int64_t due_ns = stop.begin_ns + nanoseconds(ramp_s + kSlack_s);
    const Interval meanwhile{stop.begin_ns, due_ns};
    const bool was_cleared = std::any_of(events.clears.begin(), events.clears.end(), [&](std::int64_t ns) {
      return ns >= stop.begin_ns && ns <= due_ns;
    });
    const bool is_unknown = was_cleared || due_ns > events.end_ns || overlaps_any(events.stalls, meanwhile) ||
                            overlaps_any(events.power_gone, meanwhile);
    if (!is_unknown && is_on_at(events, due_ns))
      faults.push_back(
          fmt::format("the servos have power {:.3f} s after a stop", seconds(stop.begin_ns, due_ns)));
  }
  for (const GpioEvents::Power& power : events.power) {
    if (!power.is_on) continue;
    std::int64_t stopped_ns = 0;
    for (const Interval& stop : events.stops) {
      if (stop.begin_ns < power.time_ns) stopped_ns = std::max(stopped_ns, stop.begin_ns);
    }
    // Switched on in the same instant: the watching thread had not looked yet.
    constexpr std::int64_t kLook_ns = 20'000'000;
    const bool has_word = stopped_ns == 0 || power.time_ns - stopped_ns < kLook_ns ||
                          std::any_of(events.clears.begin(), events.clears.end(), [&](std::int64_t ns) {
                            return ns > stopped_ns && ns <= power.time_ns;
                          });
    if (!has_word)
      faults.push_back(fmt::format("the servos get power {:.3f} s after a stop that nobody has cleared",
                                   seconds(stopped_ns, power.time_ns)));
  }
  return faults;
}

}  // namespace corbot::soak
