// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "corbot/channel/snapshot_cell.h"

namespace corbot::rt {

/// The latest value of a record with one writer that may be stopped in the middle of a store for any time.
/// Readers do not wait: they then get the previous record, never none. Both sides are real-time safe.
///
/// It has two cells, written one after the other. While a store to one is under way, the other is complete: a
/// store into one begins only after that into the other has ended. Each store ends with a release that its
/// reader acquires, so the order holds for readers, too. The first cell is read first, and is never older
/// than the second: no reader goes back.
template <class Record>
class LastingCell {
 public:
  /// For the one writer.
  void store(const Record& record) noexcept {
    first_.store(record);
    second_.store(record);
  }
  /// For any reader. False if nothing has ever been stored; `record` is then unchanged.
  [[nodiscard]] bool load(Record& record) const noexcept {
    return first_.load(record) || second_.load(record);
  }

 private:
  SnapshotCell<Record> first_;
  SnapshotCell<Record> second_;
};

}  // namespace corbot::rt
