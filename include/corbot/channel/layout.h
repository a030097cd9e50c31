// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <type_traits>

#include "corbot/channel/control_flags.h"
#include "corbot/channel/records.h"
#include "corbot/channel/ring.h"
#include "corbot/channel/snapshot_cell.h"
#include "corbot/channel/trace.h"
#include "corbot/motion/command.h"

namespace corbot {

/// "corbot-1" in memory, read from left to right on a little-endian machine.
inline constexpr std::uint64_t kSegmentMagic = 0x312d'746f'6272'6f63;
/// To be raised with every change to SegmentLayout or to a record in it.
inline constexpr std::uint32_t kSegmentAbi = 4;
/// Longest name of a robot; letters, digits, '_' and '-'.
inline constexpr std::size_t kMaxSegmentName = 48;

struct SegmentHeader {
  /// Stored last, with release, by the task that creates the segment: a process that loads it with acquire
  /// sees all the rest initialised. 0 = being created, or its creator died.
  std::atomic<std::uint64_t> magic{0};
  std::uint32_t abi{0};
  /// 1: a task saw an emergency stop and ended before its cycle could latch it; until a clear.
  std::atomic<std::uint32_t> stop_seen{0};
  std::uint64_t total_size{0};       ///< sizeof(SegmentLayout) of the creator
  std::uint64_t fingerprint{0};      ///< of the ArmModel, see fingerprint.h
  char name[kMaxSegmentName + 8]{};  ///< of the robot, zero-terminated
  /// Of the real-time task: 1 for the creator, +1 at each adoption.
  std::atomic<std::uint64_t> incarnation{0};
  std::atomic<std::int32_t> rt_pid{0};  ///< last holder; alive only if it holds its lock
  std::atomic<std::int32_t> servant_pid{0};
  std::atomic<std::uint64_t> next_command_id{1};  ///< the servant's; outlives it
};

/// The whole segment. Commands, control flags and next_command_id are written by the servant, everything else
/// by the real-time task; each side treats what the other writes as input to be checked.
struct SegmentLayout {
  SegmentHeader header;
  ControlFlags control;
  Ring<Command, 64> commands;
  Ring<Completion, 128> completions;
  Ring<AlarmEvent, 64> alarms;
  SnapshotCell<Snapshot> snapshot;
  SnapshotCell<LoopDiagnostics> diagnostics;
  alignas(kCacheLine) std::atomic<std::uint32_t> wake{0};  ///< futex word, see wake.h
  Trace trace;
};
static_assert(std::is_standard_layout_v<SegmentLayout>);

/// The newest snapshot that is whole. A task that is killed inside SnapshotCell::store leaves that cell torn
/// until the next store; then the flight recorder still has the cycle before.
/// False when there has never been one.
[[nodiscard]] inline bool last_snapshot(const SegmentLayout& layout, Snapshot& snapshot) noexcept {
  if (layout.snapshot.load(snapshot)) return true;
  const std::uint64_t next = layout.trace.next();
  for (std::uint64_t back = 1; back <= std::min<std::uint64_t>(next, 2); ++back) {
    if (layout.trace.read(next - back, snapshot)) return true;
  }
  return false;
}

}  // namespace corbot
