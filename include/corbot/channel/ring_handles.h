// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>

#include "corbot/channel/ring.h"

// The two ends of a Ring for a process that keeps one for long: its own index, and the last value seen of the
// other's, in its own memory. The other side's cache line is fetched once a filling or emptying instead of
// once a record. A ring is used either through one handle an end or through its own push() and pop() at that
// end, not both at a time. Real-time safe.

namespace corbot {

/// Memory orders as at Ring. A remembered tail is one that was once loaded with acquire: the slots before it
/// are free for good, since only this side fills them.
template <class Record, std::size_t kCapacity, class Atomics>
class RingProducer<Ring<Record, kCapacity, Atomics>> {
 public:
  using RingType = Ring<Record, kCapacity, Atomics>;

  /// Takes up where the ring's last producer ended.
  explicit RingProducer(RingType& ring) noexcept
      : ring_(&ring),
        head_(ring.head_.load(std::memory_order_relaxed)),
        tail_(ring.tail_.load(Atomics::kRingReuse)) {}

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

/// Memory orders as at Ring. A remembered head is one that was once loaded with acquire and checked: the
/// records before it are whole. The consumer's own index is never read back from shared memory, where the
/// other side might change it.
template <class Record, std::size_t kCapacity, class Atomics>
class RingConsumer<Ring<Record, kCapacity, Atomics>> {
 public:
  using RingType = Ring<Record, kCapacity, Atomics>;

  /// Takes up where the ring's last consumer ended.
  explicit RingConsumer(RingType& ring) noexcept
      : ring_(&ring), tail_(ring.tail_.load(std::memory_order_relaxed)), head_(tail_) {}

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
