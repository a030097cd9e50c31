// SPDX-License-Identifier: Apache-2.0
#include "soak/evidence.h"

#include <algorithm>
#include <limits>

namespace corbot::soak {
namespace {

/// The servant says within this that the task is frozen (`[loop] frozen_ms`, and half a second for the
/// calls).
constexpr std::int64_t kNoticed_ns = 500'000'000;

}  // namespace

bool Evidence::is_disturbed(const Interval& time, std::initializer_list<const char*> words,
                            int client) const {
  constexpr std::int64_t kBackAgain_ns = 2'000'000'000;
  const Interval around{time.begin_ns - kBackAgain_ns, time.end_ns};
  const auto concerns = [&](const Break& b) {
    if (b.client != 0) return b.client == client;
    return std::any_of(words.begin(), words.end(),
                       [&](const char* word) { return b.what.find(word) != std::string::npos; });
  };
  return std::any_of(breaks.begin(), breaks.end(),
                     [&](const Break& b) { return overlap(b, around) && concerns(b); }) ||
         std::any_of(stalls.begin(), stalls.end(), [&](const Interval& s) { return overlap(s, time); });
}

double covered_s(std::vector<Interval> intervals, const Interval& within) {
  std::sort(intervals.begin(), intervals.end(),
            [](const Interval& a, const Interval& b) { return a.begin_ns < b.begin_ns; });
  std::int64_t sum_ns = 0;
  std::int64_t until_ns = within.begin_ns;
  for (const Interval& interval : intervals) {
    const std::int64_t begin_ns = std::max(interval.begin_ns, until_ns);
    const std::int64_t end_ns = std::min(interval.end_ns, within.end_ns);
    if (end_ns <= begin_ns) continue;
    sum_ns += end_ns - begin_ns;
    until_ns = end_ns;
  }
  return static_cast<double>(sum_ns) * 1e-9;
}

std::vector<Interval> lost_cycles(const Evidence& evidence, const Interval& within) {
  const auto& silences = evidence.recording.silences();
  std::vector<Interval> lost;
  auto silence = std::lower_bound(silences.begin(), silences.end(), within.begin_ns,
                                  [](const Silence& s, std::int64_t ns) { return s.end_ns < ns; });
  for (; silence != silences.end() && silence->begin_ns <= within.end_ns; ++silence)
    lost.push_back({silence->begin_ns, std::min(silence->end_ns, silence->begin_ns + kNoticed_ns)});
  return lost;
}

std::int64_t next_death_ns(const Evidence& evidence, std::int64_t after_ns) {
  std::int64_t first_ns = std::numeric_limits<std::int64_t>::max();
  for (const Break& b : evidence.breaks) {
    if (b.what == "kill supervisor" && b.begin_ns >= after_ns) first_ns = std::min(first_ns, b.begin_ns);
  }
  return first_ns;
}

}  // namespace corbot::soak
