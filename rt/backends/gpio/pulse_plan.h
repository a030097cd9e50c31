// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <atomic>
#include <cstdint>
#include <string>

#include "corbot/kinematics/joints.h"

namespace corbot::rt {

/// The places of the pulses of one servo frame: each in a slot of its own, or all begun together.
enum class PulseOrder { kStaggered, kTogether };

/// Lines that rise together, and their falls. Line i of the request is bit i.
struct PulseGroup {
  struct Fall {
    std::int64_t after_ns{};  ///< time after the rise
    std::uint32_t lines{};
  };
  std::int64_t rise_ns{};  ///< time after the beginning of the frame
  std::uint32_t lines{};
  std::array<Fall, kMaxServos> falls{};  ///< in order of time
  std::uint32_t fall_count{};
};

struct PulsePlan {
  std::array<PulseGroup, kMaxServos> groups{};  ///< in order of time, never overlapping
  std::uint32_t group_count{};
};

/// Widths of the pulses, by line; 0: none.
struct PulseWidths {
  std::array<std::int64_t, kMaxServos> width_ns{};
  std::uint32_t count{};
};

/// The longest pulse, so that it ends within its slot.
inline constexpr std::int64_t kLongestPulse_ns = 2'600'000;
/// Falls nearer to each other than this count as one: setting the lines once takes about as long.
inline constexpr std::int64_t kSameEdge_ns = 500;

/// Real-time safe. Returns the edges of one frame.
[[nodiscard]] PulsePlan plan_pulses(const PulseWidths& widths, std::int64_t frame_ns,
                                    PulseOrder order) noexcept;

/// Counts how late edges came; one thread counts and any thread reads. Every member function except text() is
/// real-time safe.
class EdgeLateness {
 public:
  static constexpr std::array<std::int64_t, 11> kEdges_us{1, 2, 5, 10, 20, 50, 100, 200, 500, 1000, 5000};
  static constexpr std::size_t kBuckets = kEdges_us.size() + 1;

  void count(std::int64_t late_ns) noexcept;
  [[nodiscard]] std::uint64_t bucket(std::size_t i) const noexcept {
    return buckets_[i].load(std::memory_order_relaxed);
  }
  [[nodiscard]] std::uint64_t total() const noexcept;
  [[nodiscard]] std::int64_t longest_ns() const noexcept {
    return longest_ns_.load(std::memory_order_relaxed);
  }
  /// Returns "3000 pulses: 0.1 % longer than 5 us, ...", the whole histogram in one line.
  [[nodiscard]] std::string text() const;

 private:
  std::array<std::atomic<std::uint64_t>, kBuckets> buckets_{};
  std::atomic<std::int64_t> longest_ns_{0};
};

}  // namespace corbot::rt
