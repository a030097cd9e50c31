// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <cstdint>
#include <type_traits>

#include "corbot/channel/snapshot_cell.h"

namespace corbot {

/// Cancels the commands with these numbers, both included. A running command slows down on its path; a
/// waiting one is never begun. A request is new if its count differs from the last one carried out.
struct CancelRequest {
  std::uint64_t count;
  std::uint64_t first;
  std::uint64_t last;
};
static_assert(std::is_trivially_copyable_v<CancelRequest> && sizeof(CancelRequest) % 8 == 0);

/// The requests that pre-empt motions. The servant writes them, the real-time task reads them every cycle,
/// and they are never queued. Counters count requests, so that none is lost or carried out twice; the task
/// echoes them in the snapshot. The reader trusts no value: it clamps the override to (0, 1], and takes a
/// value that is not finite as 1.
struct ControlFlags {
  alignas(64) std::atomic<std::uint64_t> clear_count{0};  ///< Clear requests so far
  /// Number of the servant's newest Stop, or of a later stop that the task has carried out; see
  /// raise_stop_count().
  std::atomic<std::uint64_t> stop_count{0};
  /// The number of StopAndHold requests, and how many of them a Clear has ended. The arm is held if the two
  /// differ. A task that has lost its state finds the hold here.
  std::atomic<std::uint64_t> hold_count{0};
  std::atomic<std::uint64_t> holds_cleared{0};
  std::atomic<std::uint32_t> pause{0};  ///< 1 = hold virtual time
  /// Rises several times in the profile's orphan_s, and wraps around. The servant's thread that has checked
  /// the servant's response raises it. If it stands still, the task stops the running motion.
  std::atomic<std::uint32_t> servant_beat{0};
  std::atomic<double> override_ratio{1.0};  ///< (0, 1]
  /// The newest request; the servant stores the next when the task has echoed this one. A cell keeps the
  /// range of one request together: a torn range might name commands that no request cancels.
  SnapshotCell<CancelRequest> cancel;
};
static_assert(std::atomic<std::uint64_t>::is_always_lock_free && std::atomic<double>::is_always_lock_free);

/// Tells whether stop `a` comes before `b`, in the manner of serial numbers. No value left in the counter can
/// then disable stopping.
[[nodiscard]] constexpr bool is_earlier_stop(std::uint64_t a, std::uint64_t b) noexcept {
  return static_cast<std::int64_t>(a - b) < 0;
}

/// For the servant, any thread. Raises the count to `seen`, the last stop that the task has carried out, and
/// returns the last stop known. Motions planned from now on come after that stop. The raised count ensures
/// that the servant's next Stop has a later number than all that it has planned under. No stop of another
/// process in between can have taken that number.
///
/// Memory order. Release: the number is visible before any command that is pushed with it. Acquire: a Stop
/// whose number is read here was requested before.
inline std::uint64_t raise_stop_count(std::atomic<std::uint64_t>& count, std::uint64_t seen) noexcept {
  std::uint64_t now = count.load(std::memory_order_acquire);
  while (is_earlier_stop(now, seen)) {
    if (count.compare_exchange_weak(now, seen, std::memory_order_acq_rel, std::memory_order_acquire))
      return seen;
  }
  return now;
}

}  // namespace corbot
