// SPDX-License-Identifier: Apache-2.0
#include "rt/backends/gpio/pulse_plan.h"

#include <algorithm>

namespace corbot::rt {
namespace {

constexpr std::int64_t kNanosecondsPerMicrosecond = 1000;

/// Adds a fall in order of time; near ones become one.
void add_fall(PulseGroup& group, std::int64_t after_ns, std::uint32_t line) noexcept {
  std::uint32_t at = 0;
  while (at < group.fall_count && group.falls[at].after_ns < after_ns - kSameEdge_ns) ++at;
  if (at < group.fall_count && group.falls[at].after_ns <= after_ns + kSameEdge_ns) {
    group.falls[at].lines |= line;
    return;
  }
  for (std::uint32_t i = group.fall_count; i > at; --i) group.falls[i] = group.falls[i - 1];
  group.falls[at] = {after_ns, line};
  ++group.fall_count;
}

}  // namespace

PulsePlan plan_pulses(const PulseWidths& widths, std::int64_t frame_ns, PulseOrder order) noexcept {
  PulsePlan plan;
  const std::uint32_t count = std::min<std::uint32_t>(widths.count, kMaxServos);
  for (std::uint32_t i = 0; i < count; ++i) {
    if (widths.width_ns[i] <= 0) continue;
    const bool is_alone = order == PulseOrder::kStaggered;
    if (is_alone || plan.group_count == 0) {
      // A servo's slot is its own in any case: the distance of its pulses does not change.
      plan.groups[plan.group_count++].rise_ns = is_alone ? frame_ns / count * i : 0;
    }
    PulseGroup& group = plan.groups[plan.group_count - 1];
    const std::uint32_t line = 1u << i;
    group.lines |= line;
    add_fall(group, std::min(widths.width_ns[i], kLongestPulse_ns), line);
  }
  return plan;
}

void EdgeLateness::count(std::int64_t late_ns) noexcept {
  std::size_t i = 0;
  while (i < kEdges_us.size() && late_ns >= kEdges_us[i] * kNanosecondsPerMicrosecond) ++i;
  buckets_[i].fetch_add(1, std::memory_order_relaxed);
  if (late_ns > longest_ns_.load(std::memory_order_relaxed)) {
    longest_ns_.store(late_ns, std::memory_order_relaxed);
  }
}

std::uint64_t EdgeLateness::total() const noexcept {
  std::uint64_t sum = 0;
  for (const auto& bucket : buckets_) sum += bucket.load(std::memory_order_relaxed);
  return sum;
}

std::string EdgeLateness::text() const {
  std::string text = std::to_string(total()) + " pulses ended late by:";
  for (std::size_t i = 0; i < kBuckets; ++i) {
    const std::uint64_t count = bucket(i);
    if (count == 0) continue;
    const bool is_last = i == kEdges_us.size();
    text += (is_last ? " more " : " <" + std::to_string(kEdges_us[i]) + " us ") + std::to_string(count) + ",";
  }
  return text + " at most " + std::to_string(longest_ns() / kNanosecondsPerMicrosecond) + " us";
}

}  // namespace corbot::rt
