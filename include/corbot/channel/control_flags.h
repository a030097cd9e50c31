// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <cstdint>
#include <type_traits>

#include "corbot/channel/snapshot_cell.h"

namespace corbot {

/// Takes back the commands with these numbers, both included: what runs of them slows down on its path, what
/// waits is never begun. A request is new when its count differs from the last that was carried out.
struct CancelRequest {
  std::uint64_t count;
  std::uint64_t first;
  std::uint64_t last;
};
static_assert(std::is_trivially_copyable_v<CancelRequest> && sizeof(CancelRequest) % 8 == 0);

/// What pre-empts: written by the servant, read by the real-time task every cycle, never queued. Counters
/// count requests, so that none is lost and none is carried out twice; the task echoes them in the snapshot.
/// The reader trusts no value: the override is clamped to (0, 1], anything not finite counts as 1.
struct ControlFlags {
  alignas(64) std::atomic<std::uint64_t> clear_count{0};  ///< Clear requests so far
  /// Number of the servant's newest Stop, or of a later stop that the task has carried out; see
  /// raise_stop_count().
  std::atomic<std::uint64_t> stop_count{0};
  /// StopAndHold requests so far, and how many of them a Clear has taken back. A task that has lost what it knew
  /// finds in these two that the arm is held; where they differ it is.
  std::atomic<std::uint64_t> hold_count{0};
  std::atomic<std::uint64_t> holds_cleared{0};
  std::atomic<std::uint32_t> pause{0};  ///< 1 = hold virtual time
  /// Rises several times in the profile's orphan_s, by the thread of the servant that has seen that it
  /// responds; wraps around. Where it stands still, the task stops what runs.
  std::atomic<std::uint32_t> servant_beat{0};
  std::atomic<double> override_ratio{1.0};  ///< (0, 1]
  /// The newest request; the next is stored when the task has echoed this one. A cell, so that the range is
  /// of one request: torn, it might name commands that nobody takes back.
  SnapshotCell<CancelRequest> cancel;
};
static_assert(std::atomic<std::uint64_t>::is_always_lock_free && std::atomic<double>::is_always_lock_free);

/// Is stop `a` of before `b`? In the manner of serial numbers: no value that is left there may put an end to
/// stopping.
[[nodiscard]] constexpr bool is_earlier_stop(std::uint64_t a, std::uint64_t b) noexcept {
  return static_cast<std::int64_t>(a - b) < 0;
}

/// The servant, any thread: the last stop that it knows of, where the task has carried out those up to
/// `seen`. What it plans from now on comes after that stop. Kept, so that its next Stop has a later number
/// than all that it has planned under: no stop of another process in between can have taken that number.
///
/// Memory order. Release: the number is there before any command that is pushed with it. Acquire: a Stop
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
