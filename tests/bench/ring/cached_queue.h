// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <cstddef>
#include <vector>

namespace corbot::bench {

/// A peer for this comparison, written in the manner of rigtorp/SPSCQueue. Its slots are free-running with
/// one left empty, and its indices wrap by comparison. Each side's copy of the other's index lies beside its
/// own, on that side's cache line.
template <class Record, std::size_t kCapacity>
class CachedQueue {
 public:
  bool push(const Record& record) noexcept {
    const std::size_t write = write_.load(std::memory_order_relaxed);
    const std::size_t next = write + 1 == slots_.size() ? 0 : write + 1;
    if (next == read_seen_) {
      read_seen_ = read_.load(std::memory_order_acquire);
      if (next == read_seen_) return false;
    }
    slots_[write].record = record;
    write_.store(next, std::memory_order_release);
    return true;
  }

  bool pop(Record& record) noexcept {
    const std::size_t read = read_.load(std::memory_order_relaxed);
    if (read == write_seen_) {
      write_seen_ = write_.load(std::memory_order_acquire);
      if (read == write_seen_) return false;
    }
    record = slots_[read].record;
    read_.store(read + 1 == slots_.size() ? 0 : read + 1, std::memory_order_release);
    return true;
  }

 private:
  /// Aligned like the ring's, so that the comparison is one of the index protocols, not of how many lines a
  /// record touches.
  struct alignas(64) Slot {
    Record record{};
  };
  std::vector<Slot> slots_ = std::vector<Slot>(kCapacity + 1);
  alignas(64) std::atomic<std::size_t> write_{0};
  alignas(64) std::size_t read_seen_{0};
  alignas(64) std::atomic<std::size_t> read_{0};
  alignas(64) std::size_t write_seen_{0};
};

}  // namespace corbot::bench
