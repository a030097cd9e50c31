// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>

#include "corbot/channel/records.h"
#include "corbot/channel/snapshot_cell.h"

namespace corbot {

/// Flight recorder: holds the last kSlots records, one a cycle, and overwrites the oldest first. It has one
/// writer and any number of readers; no reader can delay the writer. It lives in shared memory; all zero =
/// empty. Real-time safe.
///
/// Memory orders: a slot is a SnapshotCell, which proves itself whole. The index stored with the record
/// proves that it is the wanted one. The writer stores next_ with release after the slot. A reader that
/// acquires it finds the record or a later one in the slot. With next_ relaxed a reader might find the slot's
/// previous record, which the index rejects. With the order, read() of an announced index fails only if the
/// record was overwritten.
template <class Record, std::size_t kSlots, class Atomics = StdAtomics>
class BasicTrace {
  static_assert((kSlots & (kSlots - 1)) == 0);

 public:
  /// For the one writer.
  void append(const Record& record) noexcept {
    const std::uint64_t index = next_.load(std::memory_order_relaxed);
    slots_[index & (kSlots - 1)].store(Entry{index, record});
    next_.store(index + 1, Atomics::kTracePublish);
  }

  /// Returns the index of the next record; the readable ones are [next() − capacity(), next()), from 0.
  [[nodiscard]] std::uint64_t next() const noexcept { return next_.load(Atomics::kTraceObserve); }

  /// Reads record `index`. False if it has been overwritten or does not exist yet; `record` is then
  /// unchanged.
  [[nodiscard]] bool read(std::uint64_t index, Record& record) const noexcept {
    Entry entry{};
    if (index >= next() || !slots_[index & (kSlots - 1)].load(entry) || entry.index != index) return false;
    record = entry.record;
    return true;
  }

  [[nodiscard]] static constexpr std::size_t capacity() noexcept { return kSlots; }

 private:
  struct Entry {
    std::uint64_t index;
    Record record;
  };

  alignas(kCacheLine) typename Atomics::template Atomic<std::uint64_t> next_{0};
  SnapshotCell<Entry, Atomics> slots_[kSlots]{};
};

/// Four seconds at 1 kHz.
inline constexpr std::size_t kTraceSlots = 4096;
using Trace = BasicTrace<Snapshot, kTraceSlots>;

}  // namespace corbot
