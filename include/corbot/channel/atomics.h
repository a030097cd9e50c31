// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <cstddef>

namespace corbot {

/// A plain, non-atomic place for one record. The ring accesses it through write() and read(), so that a
/// checker can substitute a cell that detects races.
template <class T>
struct PlainCell {
  T value{};
  void write(const T& from) noexcept { value = from; }
  void read(T& to) const noexcept { to = value; }
};

/// The atomics of Ring, SnapshotCell and BasicTrace, and the memory order of each of their accesses. A
/// checker substitutes its own types. A test shows that an order is needed by weakening that one constant.
/// The argument for each order stands beside its use.
struct StdAtomics {
  template <class T>
  using Atomic = std::atomic<T>;
  template <class T>
  using Cell = PlainCell<T>;

  static constexpr std::memory_order kRingPublish = std::memory_order_release;  ///< producer stores head
  static constexpr std::memory_order kRingTake = std::memory_order_acquire;     ///< consumer loads head
  static constexpr std::memory_order kRingFree = std::memory_order_release;     ///< consumer stores tail
  static constexpr std::memory_order kRingReuse = std::memory_order_acquire;    ///< producer loads tail

  static constexpr std::memory_order kCellWordStore = std::memory_order_release;
  static constexpr std::memory_order kCellWordLoad = std::memory_order_acquire;
  static constexpr std::memory_order kCellSequencePublish = std::memory_order_release;  ///< the even value
  static constexpr std::memory_order kCellSequenceLoad = std::memory_order_acquire;     ///< before the words
  /// Added to an even sequence while a writer writes. 1: the sequence is odd, and readers see the write.
  static constexpr unsigned kCellWriting = 1;
  /// Attempts of one load() before it gives up; a writer takes well under a microsecond.
  static constexpr int kCellAttempts = 64;

  static constexpr std::memory_order kTracePublish = std::memory_order_release;
  static constexpr std::memory_order kTraceObserve = std::memory_order_acquire;
};

/// Distance between data that two cores write, against false sharing. It is fixed because it is part of the
/// segment's layout.
inline constexpr std::size_t kCacheLine = 64;

}  // namespace corbot
