// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <linux/futex.h>
#include <sys/syscall.h>
#include <time.h>
#include <unistd.h>

#include <atomic>
#include <cstdint>

namespace corbot {

/// Increments the futex word and wakes one thread that waits for it, in any process. Only the servant's
/// thread that drains the rings waits here. It wakes the others, so that the loop's work does not grow with
/// their number. Never blocks, but is a system call: for the loop, not for the cycle's step function.
/// Release: a reader of the new value sees all records published before.
inline void wake_one(std::atomic<std::uint32_t>& word) noexcept {
  static_assert(sizeof(word) == sizeof(std::uint32_t) && std::atomic<std::uint32_t>::is_always_lock_free);
  word.fetch_add(1, std::memory_order_release);
  // Not FUTEX_PRIVATE_FLAG: the word is shared between processes.
  syscall(SYS_futex, &word, FUTEX_WAKE, 1, nullptr, nullptr, 0);
}

/// Not real-time safe. Waits until the word differs from `seen`, at most `timeout_ns`; a signal or a spurious
/// wake-up may end the wait early. True if it differs. Callers read the word first, then look at the rings,
/// then wait with the value read. A wake-up in between is not lost, since the kernel compares again before it
/// sleeps.
inline bool wait_change(const std::atomic<std::uint32_t>& word, std::uint32_t seen,
                        std::int64_t timeout_ns) noexcept {
  if (word.load(std::memory_order_acquire) != seen) return true;
  if (timeout_ns > 0) {
    timespec timeout{};
    timeout.tv_sec = static_cast<time_t>(timeout_ns / 1'000'000'000);
    timeout.tv_nsec = static_cast<long>(timeout_ns % 1'000'000'000);
    syscall(SYS_futex, &word, FUTEX_WAIT, seen, &timeout, nullptr, 0);
  }
  return word.load(std::memory_order_acquire) != seen;
}

}  // namespace corbot
