// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

namespace corbot {

/// Whether a thread stands still, by a count that it raises each time that it comes round. Real-time safe.
class StillWatch {
 public:
  /// The thread that serves a device (Backend::beats()): longer than any time-out that a device has of its own, of
  /// which the longest is 2 s.
  static constexpr std::int64_t kDevice_ns = 3'000'000'000;

  explicit StillWatch(std::int64_t longest_ns) noexcept : longest_ns_(longest_ns) {}

  /// A look. `ran_ns`: time that has passed since the last, as far as the caller itself ran. Whether the count has stood
  /// still for too long; 0: there is no such thread.
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
