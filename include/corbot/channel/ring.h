// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <bit>
#include <cstddef>
#include <cstdint>
#include <type_traits>

#include "corbot/channel/atomics.h"

namespace corbot {

enum class PopResult { kEmpty, kOk, kCorrupt };

/// The storage of a bounded single-producer single-consumer queue in shared memory: indices rather than
/// pointers, all zero = empty. Indices count for ever and are masked at each use, so no value that the other
/// side may write leads outside the slots. Records go in through a RingProducer and out through a
/// RingConsumer, one of each at a time; both are real-time safe: wait-free, no allocation, no system call.
///
/// Memory orders. `head_` counts records published, `tail_` records taken.
/// - The producer stores head_ with release after the records; the consumer loads head_ with acquire before
///   it reads them. A consumer that sees the new head therefore sees the records whole. With a relaxed store
///   (or load) it may see the head first and read a slot half written.
/// - The consumer stores tail_ with release after it has copied the record out; the producer loads tail_ with
///   acquire before it writes the slot again. With either relaxed, the producer's write may overtake the
///   consumer's read, which then copies a mixture of two records.
/// - An end loads its own index relaxed, once, when it is made: it is the only writer. A new process that
///   succeeds a dead one continues after the lock hand-over in the kernel, which orders them.
/// - A remembered tail is one that was once loaded with acquire: the slots before it are free for good, since
///   only the producer fills them. A remembered head was loaded with acquire and checked: the records before
///   it are whole.
/// - push_all writes all its records before its one store of head_: the consumer sees all of them or none,
///   and a producer that dies in between has published nothing.
template <class Record, std::size_t kCapacity, class Atomics = StdAtomics>
class Ring {
  static_assert(std::is_trivially_copyable_v<Record>);
  static_assert(std::has_single_bit(kCapacity), "indices are masked");

 public:
  static constexpr std::uint64_t kMask = kCapacity - 1;

  /// Anyone. A momentary value, at most the capacity.
  [[nodiscard]] std::size_t size() const noexcept {
    const std::uint64_t tail = tail_.load(Atomics::kRingReuse);
    const std::uint64_t used = head_.load(Atomics::kRingTake) - tail;
    return static_cast<std::size_t>(used < kCapacity ? used : kCapacity);
  }
  [[nodiscard]] static constexpr std::size_t capacity() noexcept { return kCapacity; }

 private:
  template <class>
  friend class RingProducer;
  template <class>
  friend class RingConsumer;
  friend struct RingIndices;  // of the tests: writes what a broken or hostile process might

  alignas(kCacheLine) typename Atomics::template Atomic<std::uint64_t> head_{0};
  alignas(kCacheLine) typename Atomics::template Atomic<std::uint64_t> tail_{0};
  alignas(kCacheLine) typename Atomics::template Cell<Record> slots_[kCapacity]{};
};

/// The end that fills. Keeps its own index, and the last value seen of the consumer's, in its own memory: the
/// consumer's cache line is fetched once a filling instead of once a record. After the consumer has repaired a
/// corrupt head, a producer made before goes on from its own index, and the consumer repairs once more: the
/// record in between is lost. One made anew goes on from the repaired index; so the servant, whose commands
/// must not be lost, makes one for each motion. Memory orders as argued at Ring.
template <class RingType>
class RingProducer;

template <class Record, std::size_t kCapacity, class Atomics>
class RingProducer<Ring<Record, kCapacity, Atomics>> {
 public:
  using RingType = Ring<Record, kCapacity, Atomics>;

  /// Continues where the ring's last producer ended.
  explicit RingProducer(RingType& ring) noexcept
      : ring_(&ring),
        head_(ring.head_.load(std::memory_order_relaxed)),
        tail_(ring.tail_.load(Atomics::kRingReuse)) {}

  /// False, and nothing changed, when the ring is full (or its indices are corrupt;
  /// the consumer repairs that).
  [[nodiscard]] bool push(const Record& record) noexcept {
    if (head_ - tail_ >= kCapacity && !has_room(1)) return false;
    ring_->slots_[head_ & RingType::kMask].write(record);
    ++head_;
    ring_->head_.store(head_, Atomics::kRingPublish);
    return true;
  }

  /// All `count` records in order, or none.
  [[nodiscard]] bool push_all(const Record* first, std::size_t count) noexcept {
    if (!fits(count) && !has_room(count)) return false;
    for (std::size_t i = 0; i < count; ++i) ring_->slots_[(head_ + i) & RingType::kMask].write(first[i]);
    head_ += count;
    ring_->head_.store(head_, Atomics::kRingPublish);
    return true;
  }

 private:
  [[nodiscard]] bool fits(std::size_t count) const noexcept {
    const std::uint64_t used = head_ - tail_;
    return used <= kCapacity && count <= kCapacity - used;
  }
  [[nodiscard]] bool has_room(std::size_t count) noexcept {
    tail_ = ring_->tail_.load(Atomics::kRingReuse);
    return fits(count);
  }

  RingType* ring_;
  std::uint64_t head_;  ///< ours: what lies in the ring is a copy for the other side
  std::uint64_t tail_;  ///< last seen
};

/// The end that empties. Reads its own index from shared memory when it is made and never again, since the
/// other side might change it there. Memory orders as argued at Ring.
template <class RingType>
class RingConsumer;

template <class Record, std::size_t kCapacity, class Atomics>
class RingConsumer<Ring<Record, kCapacity, Atomics>> {
 public:
  using RingType = Ring<Record, kCapacity, Atomics>;

  /// Continues where the ring's last consumer ended.
  explicit RingConsumer(RingType& ring) noexcept
      : ring_(&ring), tail_(ring.tail_.load(std::memory_order_relaxed)), head_(tail_) {}

  /// The record is copied out before it is checked: what the producer does to the slot afterwards cannot
  /// change what was checked. kCorrupt: the indices cannot come from pushes and pops;
  /// the ring has been emptied.
  [[nodiscard]] PopResult pop(Record& record) noexcept {
    if (tail_ == head_) {
      head_ = ring_->head_.load(Atomics::kRingTake);
      if (tail_ == head_) return PopResult::kEmpty;
      if (head_ - tail_ > kCapacity) {
        skip();
        return PopResult::kCorrupt;
      }
    }
    ring_->slots_[tail_ & RingType::kMask].read(record);
    ++tail_;
    ring_->tail_.store(tail_, Atomics::kRingFree);
    return PopResult::kOk;
  }

  /// Drops everything published so far without reading it.
  void clear() noexcept {
    head_ = ring_->head_.load(Atomics::kRingTake);
    skip();
  }

 private:
  void skip() noexcept {
    tail_ = head_;
    ring_->tail_.store(tail_, Atomics::kRingFree);
  }

  RingType* ring_;
  std::uint64_t tail_;  ///< ours
  std::uint64_t head_;  ///< last seen, at most kCapacity ahead of tail_
};

template <class Record, std::size_t kCapacity, class Atomics>
RingProducer(Ring<Record, kCapacity, Atomics>&) -> RingProducer<Ring<Record, kCapacity, Atomics>>;
template <class Record, std::size_t kCapacity, class Atomics>
RingConsumer(Ring<Record, kCapacity, Atomics>&) -> RingConsumer<Ring<Record, kCapacity, Atomics>>;

}  // namespace corbot
