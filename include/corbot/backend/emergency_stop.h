// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <cstdint>

namespace corbot {

/// The inputs of an emergency stop; one bit each.
enum class StopSource : std::uint32_t { kGpio = 1, kDevice = 2 };

/// Whether an emergency stop is active now, by any of its sources, and how often one has been. Written by the
/// threads that watch inputs, read by the cycle, which latches it: by the count, so that a press that is over
/// before its next look is not missed. Every member function is real-time safe.
class EmergencyStop {
 public:
  void set(StopSource source, bool pressed) noexcept {
    const auto bit = static_cast<std::uint32_t>(source);
    if (pressed) {
      const bool is_new = (sources_.fetch_or(bit, std::memory_order_acq_rel) & bit) == 0;
      if (is_new) presses_.fetch_add(1, std::memory_order_release);
    } else {
      sources_.fetch_and(~bit, std::memory_order_release);
    }
  }
  /// 0: none; else the bits of StopSource.
  [[nodiscard]] std::uint32_t sources() const noexcept { return sources_.load(std::memory_order_acquire); }
  /// Of all sources since the start of the process; one that lasts counts once.
  [[nodiscard]] std::uint32_t presses() const noexcept { return presses_.load(std::memory_order_acquire); }

 private:
  std::atomic<std::uint32_t> sources_{0};
  std::atomic<std::uint32_t> presses_{0};
};

}  // namespace corbot
