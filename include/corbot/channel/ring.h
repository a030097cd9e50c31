// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <bit>
#include <cstddef>
#include <cstdint>
#include <type_traits>

#include "corbot/channel/atomics.h"

namespace corbot {

enum class PopResult { kEmpty, kOk, kCorrupt };

template <class RingType>
class RingProducer;
template <class RingType>
class RingConsumer;

/// Bounded single-producer single-consumer queue that lives in shared memory: indices rather than pointers,
/// all zero = empty. Indices count for ever and are masked at each use, so no value that the other side may
/// write leads outside the slots. Real-time safe on both sides: wait-free, no allocation, no system call.
///
/// Memory orders. `head_` counts records published, `tail_` records taken.
/// - The producer stores head_ with release after the records; the consumer loads head_ with acquire before
/// it reads
///   them. A consumer that sees the new head therefore sees the records whole. With a relaxed store (or load)
///   it may see the head first and read a slot half written.
/// - The consumer stores tail_ with release after it has copied the record out; the producer loads tail_ with
/// acquire
///   before it writes the slot again. With either relaxed, the producer's write may overtake the consumer's
///   read, which then copies a mixture of two records.
/// - Each side loads its own index relaxed: nobody else writes it. A new process that takes over a dead one's
/// side
///   continues after the lock hand-over in the kernel, which orders them.
/// - push_all writes all its records before its one store of head_: the consumer sees all of them or none,
/// and a
///   producer that dies in between has published nothing.
template <class Record, std::size_t kCapacity, class Atomics = StdAtomics>
class Ring {
  static_assert(std::is_trivially_copyable_v<Record>);
  static_assert(std::has_single_bit(kCapacity), "indices are masked");

 public:
  using RecordType = Record;
  static constexpr std::uint64_t kMask = kCapacity - 1;

  /// Producer. False, and nothing changed, when the ring is full (or its indices make no sense: the consumer
  /// mends that).
  [[nodiscard]] bool push(const Record& record) noexcept { return push_all(&record, 1); }

  /// Producer. All `count` records in order, or none.
  [[nodiscard]] bool push_all(const Record* first, std::size_t count) noexcept {
    const std::uint64_t head = head_.load(std::memory_order_relaxed);
    const std::uint64_t used = head - tail_.load(Atomics::kRingReuse);
    if (used > kCapacity || count > kCapacity - used) return false;
    for (std::size_t i = 0; i < count; ++i) slots_[(head + i) & kMask].write(first[i]);
    head_.store(head + count, Atomics::kRingPublish);
    return true;
  }

  /// Consumer. The record is copied out before anyone looks at it: what the producer does to the slot
  /// afterwards cannot change what was checked. kCorrupt: the indices cannot come from pushes and pops; the
  /// ring has been emptied.
  [[nodiscard]] PopResult pop(Record& record) noexcept {
    const std::uint64_t tail = tail_.load(std::memory_order_relaxed);
    const std::uint64_t head = head_.load(Atomics::kRingTake);
    if (head == tail) return PopResult::kEmpty;
    if (head - tail > kCapacity) {
      tail_.store(head, Atomics::kRingFree);
      return PopResult::kCorrupt;
    }
    slots_[tail & kMask].read(record);
    tail_.store(tail + 1, Atomics::kRingFree);
    return PopResult::kOk;
  }

  /// Consumer. Drops everything published so far without reading it.
  void clear() noexcept { tail_.store(head_.load(Atomics::kRingTake), Atomics::kRingFree); }

  /// Anyone. A momentary value, at most the capacity.
  [[nodiscard]] std::size_t size() const noexcept {
    const std::uint64_t tail = tail_.load(Atomics::kRingReuse);
    const std::uint64_t used = head_.load(Atomics::kRingTake) - tail;
    return static_cast<std::size_t>(used < kCapacity ? used : kCapacity);
  }
  [[nodiscard]] static constexpr std::size_t capacity() noexcept { return kCapacity; }

 private:
  template <class>
  friend class RingProducer;  // ring_handles.h
  template <class>
  friend class RingConsumer;
  friend struct RingHands;  // of the tests: writes what a broken or hostile process might

  alignas(kCacheLine) typename Atomics::template Atomic<std::uint64_t> head_{0};
  alignas(kCacheLine) typename Atomics::template Atomic<std::uint64_t> tail_{0};
  alignas(kCacheLine) typename Atomics::template Cell<Record> slots_[kCapacity]{};
};

}  // namespace corbot
