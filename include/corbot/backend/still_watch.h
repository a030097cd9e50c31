// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

namespace corbot {

/// Detects a stalled thread: its loop counter has not changed for longest_ns. Real-time safe.
class StillWatch {
 public:
  /// The bound for the thread that serves a device (Backend::beats()). It is longer than any time-out of a
  /// device; the longest time-out is 2 s.
  static constexpr std::int64_t kDevice_ns = 3'000'000'000;

  explicit StillWatch(std::int64_t longest_ns) noexcept : longest_ns_(longest_ns) {}

  /// Checks the counter. `ran_ns` is the time since the previous call during which the caller itself ran.
  /// Returns whether the thread has stalled for too long. A count of 0 means that there is no such thread.
  bool look(std::uint32_t beats, std::int64_t ran_ns) noexcept {
    still_ns_ = beats == beats_ && beats != 0 ? still_ns_ + ran_ns : 0;
    beats_ = beats;
    return is_still();
  }
  [[nodiscard]] bool is_still() const noexcept { return still_ns_ > longest_ns_; }

 private:
  std::int64_t longest_ns_;
  std::int64_t still_ns_{0};
  std::uint32_t beats_{0};
};

}  // namespace corbot
