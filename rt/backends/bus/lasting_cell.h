// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "corbot/channel/snapshot_cell.h"

namespace corbot::rt {

/// The latest value of a record, of one writer that may be stopped in the middle of a store for as long as it likes, and
/// readers that do not wait: they then get the record before, never none. Both are real-time safe.
///
/// Two cells, written one after the other: of whichever one a store is under way, the other is complete, since a store
/// into one begins only after that into the other has ended, in program order and, as each ends with a release store that
/// its reader acquires, for readers too. The first is read first, and is never older than the second: no reader goes back.
template <class Record>
class LastingCell {
 public:
  /// The one writer.
  void store(const Record& record) noexcept {
    first_.store(record);
    second_.store(record);
  }
  /// Anyone. False when nothing has ever been stored; `record` is then unchanged.
  [[nodiscard]] bool load(Record& record) const noexcept {
    return first_.load(record) || second_.load(record);
  }

 private:
  SnapshotCell<Record> first_;
  SnapshotCell<Record> second_;
};

}  // namespace corbot::rt
