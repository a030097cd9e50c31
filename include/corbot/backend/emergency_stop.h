// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <cstdint>

namespace corbot {

/// The sources of an emergency stop; one bit each.
enum class StopSource : std::uint32_t {
  kGpio = 1,
  kDevice = 2,         ///< an input of the controller
  kGpioUnheard = 4,    ///< the line cannot be read
  kDeviceUnheard = 8,  ///< the controller does not report the state of its input
  kWatchdog = 16,      ///< the watchdog output has tripped
  kWatcher = 32,       ///< the thread that watches the lines has stalled
};

/// Holds which sources of an emergency stop are active, and counts presses. The threads that watch inputs
/// write it; the cycle reads it and latches a stop. The cycle compares the count, so it does not miss a press
/// that is over before its next look. Every member function is real-time safe.
///
/// Sources and count are one word, and change in one step. A thread that stops at any instant therefore
/// leaves no source without its count, which would not be latched. Nor does it leave a count before its
/// source, which could be cleared while pressed. Memory orders: the word is the only data handed over, and it
/// has one modification order. A reader that acquires a press also sees its writer's earlier stores (a line
/// of the log, the beat). The exchange repeats only if another source has changed meanwhile; inputs change at
/// most some hundred times a second.
class EmergencyStop {
 public:
  /// Sources and count at one instant.
  struct State {
    std::uint32_t sources;  ///< 0: none; else the bits of StopSource
    std::uint32_t presses;  ///< of all sources since the start of the process; a lasting press counts once
  };

  void set(StopSource source, bool pressed) noexcept {
    const auto bit = static_cast<std::uint64_t>(source);
    std::uint64_t before = word_.load(std::memory_order_acquire);
    for (;;) {
      if (((before & bit) != 0) == pressed) return;
      const std::uint64_t after = pressed ? (before | bit) + kOnePress : before & ~bit;
      if (word_.compare_exchange_weak(before, after, std::memory_order_acq_rel, std::memory_order_acquire))
        return;
    }
  }
  [[nodiscard]] State state() const noexcept {
    const std::uint64_t word = word_.load(std::memory_order_acquire);
    return {static_cast<std::uint32_t>(word), static_cast<std::uint32_t>(word >> kPressShift)};
  }
  [[nodiscard]] std::uint32_t sources() const noexcept { return state().sources; }
  [[nodiscard]] std::uint32_t presses() const noexcept { return state().presses; }

  /// Counts a look of the watching thread. The first call comes before the first look; from then on looks are
  /// required.
  void beat() noexcept { beats_.fetch_add(1, std::memory_order_relaxed); }
  /// Returns the number of beats; 0: no separate thread watches an input.
  [[nodiscard]] std::uint32_t beats() const noexcept { return beats_.load(std::memory_order_relaxed); }

 private:
  static constexpr unsigned kPressShift = 32;
  static constexpr std::uint64_t kOnePress = std::uint64_t{1} << kPressShift;  // its carry leaves the word

  std::atomic<std::uint64_t> word_{0};
  static_assert(std::atomic<std::uint64_t>::is_always_lock_free);
  std::atomic<std::uint32_t> beats_{0};
};

}  // namespace corbot
