// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "soak/recording.h"

namespace corbot::soak {

/// The actions of the servos' power switch, and the instants of the disturbances.
struct GpioEvents {
  struct Power {
    std::int64_t time_ns{};
    bool is_on{};
  };
  std::vector<Interval> stops;       ///< presses, and chips that were away, until they were over
  std::vector<Interval> power_gone;  ///< in which the switch's own chip was away: nothing can be said of it
  std::vector<Interval> stalls;
  std::vector<std::int64_t> clears;  ///< when a person cleared
  std::vector<Power> power;
  std::int64_t end_ns{};
};

/// The power goes within ramp_s of a stop, and comes back only after a Clear that follows it.
[[nodiscard]] std::vector<std::string> judge_power(const GpioEvents& events, double ramp_s);

/// Runs presses, taps, vanishing chips, failing switches and frozen cycles at random on simulated lines
/// (fake_gpio.h). The cycle and the thread that watches the lines are those of corbot-rt. Returns true if
/// nothing was wrong.
bool run_gpio(int faults, std::uint64_t seed, bool verbose);

}  // namespace corbot::soak
