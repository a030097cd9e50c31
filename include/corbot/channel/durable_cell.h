// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <cstdint>
#include <type_traits>

#include "corbot/channel/snapshot_cell.h"

namespace corbot {

/// The latest value of a record that outlives its writer, in shared memory. It has one writer and any number
/// of readers; all zero = never stored. It consists of two SnapshotCells, written in turn. A writer that is
/// killed inside store() leaves one of them torn, and the previous record in the other. Real-time safe.
///
/// Memory orders: each cell proves itself whole, and carries the number of its store. The higher number of
/// two whole cells is the newer. Nothing else is concluded from one cell about the other.
template <class Record>
class DurableCell {
  static_assert(std::is_trivially_copyable_v<Record> && sizeof(Record) % sizeof(std::uint64_t) == 0);

 public:
  enum class Content { kNone, kRecord, kInvalid };

  /// For the one writer.
  void store(const Record& record) noexcept {
    const std::uint64_t number = stores_.load(std::memory_order_relaxed) + 1;
    stores_.store(number, std::memory_order_relaxed);
    cells_[number & 1].store(Numbered{number, record});
  }

  /// For any reader. kNone: never stored, or killed inside the first store. kInvalid: store() cannot have
  /// written this. `record` is unchanged in both cases. The caller must check every field of a record that
  /// another process wrote.
  [[nodiscard]] Content load(Record& record) const noexcept {
    Numbered first{};
    Numbered second{};
    const bool has_first = cells_[0].load(first);
    const bool has_second = cells_[1].load(second);
    const std::uint64_t stores = stores_.load(std::memory_order_relaxed);
    if (!has_first && !has_second) return stores <= 1 ? Content::kNone : Content::kInvalid;
    const bool first_is_newer = has_first && (!has_second || first.number > second.number);
    const Numbered& newer = first_is_newer ? first : second;
    if (newer.number == 0) return Content::kInvalid;
    record = newer.record;
    return Content::kRecord;
  }

 private:
  friend struct DurableCellParts;  // of the tests: writes what a killed or hostile process might

  struct Numbered {
    std::uint64_t number;
    Record record;
  };

  std::atomic<std::uint64_t> stores_{0};
  SnapshotCell<Numbered> cells_[2];
};

}  // namespace corbot
