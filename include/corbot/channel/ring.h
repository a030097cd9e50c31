// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <bit>
#include <cstddef>
#include <cstdint>
#include <type_traits>

#include "corbot/channel/atomics.h"

namespace corbot {

enum class PopResult { kEmpty, kOk, kCorrupt };

/// A bounded single-producer single-consumer queue in shared memory. It has two parts, each written by one
/// side only: RingSlots (head and records) by the producer, RingTail by the consumer. The parts may lie in
/// different segments. It has indices rather than pointers, all zero = empty. Indices count for ever and are
/// masked at each use, so no value that the other side may write leads outside the slots. Records go in
/// through a RingProducer and out through a RingConsumer, one of each at a time. Both are real-time safe:
/// wait-free, no allocation, no system call.
///
/// Memory orders. `head_` counts records published, `tail_` records taken.
/// * The producer stores head_ with release after the records; the consumer loads head_ with acquire before
///   it reads them. A consumer that sees the new head therefore sees the records whole. With a relaxed store
///   (or load) it may see the head first and read a slot half written.
/// * The consumer stores tail_ with release after it has copied the record out. The producer loads tail_ with
///   acquire before it writes the slot again. With either relaxed, the producer's write may overtake the
///   consumer's read, which then copies a mixture of two records.
/// * An end loads its own index relaxed, once, when it is made: it is the only writer. A new process that
///   succeeds a dead one continues after the hand-over of descriptors. The hand-over in the kernel orders the
///   two processes.
/// * A remembered tail was once loaded with acquire. The slots before it are free for good, since only the
///   producer fills them. A remembered head was loaded with acquire and checked: the records before it are
///   whole.
/// * `push_all` writes all its records before its one store of head_, so the consumer sees all of them or
///   none. A producer that dies in between has published nothing.
template <class Record, std::size_t kCapacity, class Atomics = StdAtomics>
class RingSlots {
  static_assert(std::is_trivially_copyable_v<Record>);
  static_assert(std::has_single_bit(kCapacity), "indices are masked");

 public:
  static constexpr std::uint64_t kMask = kCapacity - 1;
  [[nodiscard]] static constexpr std::size_t capacity() noexcept { return kCapacity; }
  /// Returns the number of records published so far; for any thread.
  [[nodiscard]] std::uint64_t published() const noexcept { return head_.load(Atomics::kRingTake); }

 private:
  template <class>
  friend class RingProducer;
  template <class>
  friend class RingConsumer;
  friend struct RingIndices;  // of the tests: writes what a broken or hostile process might

  alignas(kCacheLine) typename Atomics::template Atomic<std::uint64_t> head_{0};
  alignas(kCacheLine) typename Atomics::template Cell<Record> slots_[kCapacity]{};
};

/// The consumer's part, see RingSlots.
template <class Atomics = StdAtomics>
class RingTail {
 public:
  /// Returns the number of records taken so far; for any thread.
  [[nodiscard]] std::uint64_t taken() const noexcept { return tail_.load(Atomics::kRingReuse); }
  /// For the consumer, before the producer knows of it. Skips the records published before, or taken already.
  void begin_at(std::uint64_t taken) noexcept { tail_.store(taken, Atomics::kRingFree); }

 private:
  template <class>
  friend class RingProducer;
  template <class>
  friend class RingConsumer;
  friend struct RingIndices;

  alignas(kCacheLine) typename Atomics::template Atomic<std::uint64_t> tail_{0};
};

/// Returns the number of records in a ring, for any thread: a momentary value, at most the capacity.
template <class Record, std::size_t kCapacity, class Atomics>
[[nodiscard]] std::size_t ring_size(const RingSlots<Record, kCapacity, Atomics>& slots,
                                    const RingTail<Atomics>& tail) noexcept {
  const std::uint64_t taken = tail.taken();
  const std::uint64_t used = slots.published() - taken;
  return static_cast<std::size_t>(used < kCapacity ? used : kCapacity);
}

/// Both parts, if producer and consumer share their memory.
template <class Record, std::size_t kCapacity, class Atomics = StdAtomics>
struct Ring {
  using Slots = RingSlots<Record, kCapacity, Atomics>;
  Slots slots;
  RingTail<Atomics> tail;

  [[nodiscard]] std::size_t size() const noexcept { return ring_size(slots, tail); }
  [[nodiscard]] static constexpr std::size_t capacity() noexcept { return kCapacity; }
};

/// The end that fills the ring. It keeps its own index, and the last seen index of the consumer, in its own
/// memory. So it fetches the consumer's cache line once a filling instead of once a record. After the
/// consumer has repaired a corrupt head, a producer made before goes on from its own index. The consumer then
/// repairs once more, and the record in between is lost. A producer made anew goes on from the repaired
/// index. The servant must not lose commands, so it makes a producer for each motion. RingSlots has the
/// argument for the memory orders.
template <class Slots>
class RingProducer;

template <class Record, std::size_t kCapacity, class Atomics>
class RingProducer<RingSlots<Record, kCapacity, Atomics>> {
 public:
  using Slots = RingSlots<Record, kCapacity, Atomics>;

  /// Continues where the ring's last producer ended.
  RingProducer(Slots& slots, const RingTail<Atomics>& tail) noexcept
      : slots_(&slots),
        consumer_(&tail),
        head_(slots.head_.load(std::memory_order_relaxed)),
        tail_(tail.tail_.load(Atomics::kRingReuse)) {}
  explicit RingProducer(Ring<Record, kCapacity, Atomics>& ring) noexcept
      : RingProducer(ring.slots, ring.tail) {}

  /// Switches to another consumer. Its tail gives the records that it has taken: the producer writes no slot
  /// of the previous consumer before that.
  void follow(const RingTail<Atomics>& tail) noexcept {
    consumer_ = &tail;
    tail_ = tail.tail_.load(Atomics::kRingReuse);
  }

  /// Appends a record. False, and nothing changed, if the ring is full, or if its indices are corrupt; the
  /// consumer repairs them.
  [[nodiscard]] bool push(const Record& record) noexcept {
    if (head_ - tail_ >= kCapacity && !has_room(1)) return false;
    slots_->slots_[head_ & Slots::kMask].write(record);
    ++head_;
    slots_->head_.store(head_, Atomics::kRingPublish);
    return true;
  }

  /// Appends all `count` records in order, or none.
  [[nodiscard]] bool push_all(const Record* first, std::size_t count) noexcept {
    if (!fits(count) && !has_room(count)) return false;
    for (std::size_t i = 0; i < count; ++i) slots_->slots_[(head_ + i) & Slots::kMask].write(first[i]);
    head_ += count;
    slots_->head_.store(head_, Atomics::kRingPublish);
    return true;
  }

 private:
  [[nodiscard]] bool fits(std::size_t count) const noexcept {
    const std::uint64_t used = head_ - tail_;
    return used <= kCapacity && count <= kCapacity - used;
  }
  [[nodiscard]] bool has_room(std::size_t count) noexcept {
    tail_ = consumer_->tail_.load(Atomics::kRingReuse);
    return fits(count);
  }

  Slots* slots_;
  const RingTail<Atomics>* consumer_;
  std::uint64_t head_;  ///< ours: the head in the ring is a copy for the other side
  std::uint64_t tail_;  ///< last seen
};

/// The end that empties the ring. It reads its own index from shared memory only when it is made, since the
/// other side might change it there. RingSlots has the argument for the memory orders.
template <class Slots>
class RingConsumer;

template <class Record, std::size_t kCapacity, class Atomics>
class RingConsumer<RingSlots<Record, kCapacity, Atomics>> {
 public:
  using Slots = RingSlots<Record, kCapacity, Atomics>;

  /// Continues where the ring's last consumer ended.
  RingConsumer(const Slots& slots, RingTail<Atomics>& tail) noexcept
      : slots_(&slots), own_(&tail), tail_(tail.tail_.load(std::memory_order_relaxed)), head_(tail_) {}
  explicit RingConsumer(Ring<Record, kCapacity, Atomics>& ring) noexcept
      : RingConsumer(ring.slots, ring.tail) {}

  /// Takes a record. It is copied out before it is checked, so the producer cannot change it after the check.
  /// Returns kCorrupt if the indices cannot come from pushes and pops; the ring has been emptied then.
  [[nodiscard]] PopResult pop(Record& record) noexcept {
    if (tail_ == head_) {
      head_ = slots_->head_.load(Atomics::kRingTake);
      if (tail_ == head_) return PopResult::kEmpty;
      if (head_ - tail_ > kCapacity) {
        skip();
        return PopResult::kCorrupt;
      }
    }
    slots_->slots_[tail_ & Slots::kMask].read(record);
    ++tail_;
    own_->tail_.store(tail_, Atomics::kRingFree);
    return PopResult::kOk;
  }

  /// Drops everything published so far without reading it.
  void clear() noexcept {
    head_ = slots_->head_.load(Atomics::kRingTake);
    skip();
  }

 private:
  void skip() noexcept {
    tail_ = head_;
    own_->tail_.store(tail_, Atomics::kRingFree);
  }

  const Slots* slots_;
  RingTail<Atomics>* own_;
  std::uint64_t tail_;  ///< ours
  std::uint64_t head_;  ///< last seen, at most kCapacity ahead of tail_
};

template <class Record, std::size_t kCapacity, class Atomics>
RingProducer(Ring<Record, kCapacity, Atomics>&) -> RingProducer<RingSlots<Record, kCapacity, Atomics>>;
template <class Record, std::size_t kCapacity, class Atomics>
RingProducer(RingSlots<Record, kCapacity, Atomics>&, const RingTail<Atomics>&)
    -> RingProducer<RingSlots<Record, kCapacity, Atomics>>;
template <class Record, std::size_t kCapacity, class Atomics>
RingConsumer(Ring<Record, kCapacity, Atomics>&) -> RingConsumer<RingSlots<Record, kCapacity, Atomics>>;
template <class Record, std::size_t kCapacity, class Atomics>
RingConsumer(const RingSlots<Record, kCapacity, Atomics>&, RingTail<Atomics>&)
    -> RingConsumer<RingSlots<Record, kCapacity, Atomics>>;

}  // namespace corbot
