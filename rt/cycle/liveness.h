// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

namespace corbot::rt {

/// The time-outs of `[loop]` in the profile, for this task and for the servant.
struct LivenessLimits {
  std::int64_t gap_fault_ns{100'000'000};  ///< a longer gap between two steps is a fault
  std::int64_t orphan_ns{2'000'000'000};   ///< a motion without a responding servant is stopped after this
};

enum class Gap {
  kNone,     ///< the next period, or a few missed
  kRestart,  ///< the arm has come to rest meanwhile: the motion begins again from rate 0
  kFault,    ///< too long to be bridged without a person
};

/// Classifies the time between the steps, by their given times. Real-time safe.
class GapWatch {
 public:
  /// A longer gap, in periods, is one in which the servos have come to rest: they hold the last set-point.
  static constexpr std::int64_t kRestartPeriods = 5;

  GapWatch(std::int64_t period_ns, std::int64_t fault_ns) noexcept
      : restart_ns_(kRestartPeriods * period_ns), fault_ns_(fault_ns) {}

  /// Adds time that has passed while the clock of see() stood still.
  void add(std::int64_t ns) noexcept { besides_ns_ += ns; }
  /// Classifies the time since the previous step; kNone at the first.
  [[nodiscard]] Gap see(std::int64_t now_ns) noexcept {
    gap_ns_ = has_last_ ? now_ns - last_ns_ + besides_ns_ : 0;
    besides_ns_ = 0;
    last_ns_ = now_ns;
    has_last_ = true;
    if (gap_ns_ > fault_ns_) return Gap::kFault;
    return gap_ns_ > restart_ns_ ? Gap::kRestart : Gap::kNone;
  }
  [[nodiscard]] std::int64_t gap_ns() const noexcept { return gap_ns_; }
  /// Returns the part of the last gap that this process has seen pass: at most a few periods.
  [[nodiscard]] std::int64_t seen_ns() const noexcept {
    return gap_ns_ < restart_ns_ ? gap_ns_ : restart_ns_;
  }

 private:
  std::int64_t restart_ns_;
  std::int64_t fault_ns_;
  std::int64_t last_ns_{0};
  std::int64_t gap_ns_{0};
  std::int64_t besides_ns_{0};
  bool has_last_{false};
};

/// Measures suspensions of the machine. CLOCK_BOOTTIME counts them; CLOCK_MONOTONIC, by which the loop
/// sleeps, does not. The clocks cannot be read in one instant, so their difference is known between two
/// bounds. Only a difference beyond the previous bounds is a suspension, even if this thread was preempted
/// between two readings. Real-time safe.
class SuspensionWatch {
 public:
  /// `boot_ns` was read between the other two, which are of CLOCK_MONOTONIC. Returns the suspension since the
  /// last call, to within the time of the readings; 0 at the first.
  [[nodiscard]] std::int64_t see(std::int64_t before_ns, std::int64_t boot_ns,
                                 std::int64_t after_ns) noexcept {
    const std::int64_t least_ns = boot_ns - after_ns;
    const std::int64_t most_ns = boot_ns - before_ns;
    const bool is_longer = has_difference_ && least_ns > most_ns_;
    const std::int64_t suspended_ns = is_longer ? least_ns - most_ns_ : 0;
    if (!has_difference_ || is_longer || most_ns < most_ns_) most_ns_ = most_ns;
    has_difference_ = true;
    return suspended_ns;
  }

 private:
  std::int64_t most_ns_{0};  ///< the difference is not above this
  bool has_difference_{false};
};

/// Detects whether the servant responds, by its beat (ControlFlags::servant_beat). Real-time safe.
class ServantWatch {
 public:
  explicit ServantWatch(std::int64_t orphan_ns) noexcept : orphan_ns_(orphan_ns) {}

  /// Called once a step. `seen_ns`: time that has passed, without gaps of this process. `is_busy`: a motion
  /// runs or is queued. True if the beat has stood still for too long meanwhile; the counting then begins
  /// anew.
  [[nodiscard]] bool is_silent(std::uint32_t beat, std::int64_t seen_ns, bool is_busy) noexcept {
    silent_ns_ = beat == beat_ && is_busy ? silent_ns_ + seen_ns : 0;
    beat_ = beat;
    if (silent_ns_ <= orphan_ns_) return false;
    silent_ns_ = 0;
    return true;
  }

 private:
  std::int64_t orphan_ns_;
  std::int64_t silent_ns_{0};
  std::uint32_t beat_{0};
};

/// Counts overruns, and decides when to report them: the first at once, later ones together after an
/// interval. Real-time safe.
class OverrunCount {
 public:
  static constexpr std::int64_t kReportInterval_ns = 60'000'000'000;

  void add() noexcept { ++total_; }
  [[nodiscard]] std::uint64_t total() const noexcept { return total_; }
  /// Returns the overruns since the last report; 0: no report is due.
  [[nodiscard]] std::uint64_t take_report(std::int64_t now_ns) noexcept {
    if (total_ == reported_ || (reported_ != 0 && now_ns - reported_at_ns_ < kReportInterval_ns)) return 0;
    const std::uint64_t count = total_ - reported_;
    reported_ = total_;
    reported_at_ns_ = now_ns;
    return count;
  }

 private:
  std::uint64_t total_{0};
  std::uint64_t reported_{0};
  std::int64_t reported_at_ns_{0};
};

}  // namespace corbot::rt
