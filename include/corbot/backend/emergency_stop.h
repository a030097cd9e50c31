// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <cstdint>

namespace corbot {

/// The inputs of an emergency stop, and what counts as one; one bit each.
enum class StopSource : std::uint32_t {
  kGpio = 1,
  kDevice = 2,         ///< an input of the controller
  kGpioUnheard = 4,    ///< the line cannot be read
  kDeviceUnheard = 8,  ///< the controller does not say how its input is
  kWatchdog = 16,      ///< the watchdog output has tripped
  kWatcher = 32,       ///< the thread that watches the lines stands still
};

/// Whether an emergency stop is active now, by any of its sources, and how often one has been. Written by the
/// threads that watch inputs, read by the cycle, which latches it: by the count, so that a press that is over
/// before its next look is not missed. Every member function is real-time safe.
///
/// Sources and count are one word, and so change in one step: a thread that is stopped at whichever instant leaves no
/// source without its count, which nobody would latch, and no count before its source, which could be cleared while
/// pressed. Memory orders: the word is all that is handed over, and it has one modification order; release and acquire
/// let what was done before a press (a line of the log, the beat) be seen by who sees the press. A repeat of the
/// exchange is due only where another source has changed meanwhile, which inputs do some hundred times a second at most.
class EmergencyStop {
 public:
  /// Both at one instant.
  struct State {
    std::uint32_t sources;  ///< 0: none; else the bits of StopSource
    std::uint32_t presses;  ///< of all sources since the start of the process; one that lasts counts once
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

  /// The watching thread has looked; or, before its first look, begins to: from then on it is demanded.
  void beat() noexcept { beats_.fetch_add(1, std::memory_order_relaxed); }
  /// How often it has looked; 0: nothing is watched by a thread of its own.
  [[nodiscard]] std::uint32_t beats() const noexcept { return beats_.load(std::memory_order_relaxed); }

 private:
  static constexpr unsigned kPressShift = 32;
  static constexpr std::uint64_t kOnePress = std::uint64_t{1} << kPressShift;  // its carry leaves the word

  std::atomic<std::uint64_t> word_{0};
  static_assert(std::atomic<std::uint64_t>::is_always_lock_free);
  std::atomic<std::uint32_t> beats_{0};
};

}  // namespace corbot
