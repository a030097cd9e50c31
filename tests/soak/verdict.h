// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <map>
#include <string>
#include <vector>

#include "config/profile.h"
#include "soak/ledger.h"
#include "soak/recording.h"

namespace corbot::soak {

/// An interval during which something was broken on purpose, until the robot served again; CLOCK_MONOTONIC.
struct Disturbance {
  std::int64_t begin_ns{};
  std::int64_t end_ns{};
  std::string what;
};

/// A Clear that a person would have had to give.
struct Clear {
  std::int64_t time_ns{};
  std::string cause;  ///< the active alarms that do not pass by themselves
};

struct Verdict {
  std::vector<std::string> faults;
  int calls{};
  int unanswered{};  ///< by clients that were killed
  int motions{};
  int whole_motions{};                ///< that reached their end, and so name their call
  std::map<std::string, int> clears;  ///< cause and what was broken before -> how many
  double slowest_undisturbed_s{};
  double slowest_s{};
};

/// What the recording says against what the clients were told: no motion without a caller, none twice, none after a stop,
/// every caller answered within its bound, the tool within its limits on lines, no Clear but after a time without cycles.
Verdict judge(const Profile& profile, const Ledger& ledger, const Recording& recording,
              const std::vector<Disturbance>& disturbances, const std::vector<Clear>& clears = {});

}  // namespace corbot::soak
