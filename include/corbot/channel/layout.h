// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <type_traits>

#include "corbot/arm/workspace_limits.h"
#include "corbot/channel/control_flags.h"
#include "corbot/channel/records.h"
#include "corbot/channel/ring.h"
#include "corbot/channel/servant_state.h"
#include "corbot/channel/snapshot_cell.h"
#include "corbot/channel/trace.h"
#include "corbot/motion/command.h"
#include "corbot/motion/rate_knots.h"
#include "corbot/motion/rate_pieces.h"

// One robot's channel: three segments of shared memory, each with one writer. Every other process maps a
// segment read-only, and treats its contents as input to be checked.

namespace corbot {

/// "corbot-1" in memory, read from left to right on a little-endian machine.
inline constexpr std::uint64_t kSegmentMagic = 0x312d'746f'6272'6f63;
/// Must be raised with every change to a segment or to a record in it.
inline constexpr std::uint32_t kSegmentAbi = 12;
/// Longest name of a robot; letters, digits, '_' and '-'.
inline constexpr std::size_t kMaxSegmentName = 48;

enum class SegmentKind : std::uint32_t { kTask = 1, kServant = 2, kStop = 3 };

/// The creator writes it before any other process has a descriptor of the segment, and never again.
struct SegmentHeader {
  std::uint64_t magic{0};
  std::uint32_t abi{0};
  SegmentKind kind{};
  std::uint64_t total_size{0};   ///< of the creator's layout
  std::uint64_t fingerprint{0};  ///< of the ArmModel, see fingerprint.h
  std::uint64_t id{0};           ///< random and unique among segments
  std::int32_t pid{0};           ///< of the creator
  std::uint32_t reserved{0};
  char name[kMaxSegmentName + 8]{};  ///< of the robot, zero-terminated
};

/// The real-time task's segment. Each task creates a new one, so that no other process can ever write it.
struct TaskSegment {
  static constexpr SegmentKind kKind = SegmentKind::kTask;
  SegmentHeader header;
  /// The number of the real-time task: one more than that of the task whose segment was taken over, else new.
  std::uint64_t incarnation{1};
  /// 1 until a clear: a task saw an emergency stop and ended before its cycle could latch it.
  std::atomic<std::uint32_t> stop_seen{0};
  RingTail<> commands_tail;  ///< the connected servant's commands
  RingSlots<Completion, 128> completions;
  RingSlots<AlarmEvent, 64> alarms;
  SnapshotCell<Snapshot> snapshot;
  SnapshotCell<LoopDiagnostics> diagnostics;
  alignas(kCacheLine) std::atomic<std::uint32_t> wake{0};  ///< futex word, see wake.h
  Trace trace;
};
static_assert(std::is_standard_layout_v<TaskSegment>);

/// Knots and pieces of one path. They are written before the command that names the slot is published.
struct RateSlot {
  std::array<rate::Knot, kMostKnots> knots;
  std::array<rate::Piece, rate::kMostPieces> pieces;
};
/// One slot for every command in the ring, one for the command that the task is taking, and one to spare. The
/// slots are used in turn, so a slot is written again only after the task has copied its contents.
inline constexpr std::size_t kKnotSlots = 66;

/// The servant's segment; each servant creates a new one. The next servant copies the state that must outlive
/// it. The task hands the previous servant's segment to it, read-only.
struct ServantSegment {
  static constexpr SegmentKind kKind = SegmentKind::kServant;
  SegmentHeader header;
  ControlFlags control;
  std::atomic<std::uint64_t> next_command_id{1};
  /// Header id of the task's segment to which the tails below belong.
  std::atomic<std::uint64_t> task_id{0};
  RingTail<> completions_tail;
  RingTail<> alarms_tail;
  RingSlots<Command, 64> commands;
  ServantState state;
  std::array<RateSlot, kKnotSlots> rates;
  /// They serve all commands in the ring that name any. They change only while the ring is empty.
  SnapshotCell<FurtherShapes> shapes;
};
static_assert(std::is_standard_layout_v<ServantSegment>);

/// The segment of clients that may stop the robot without its servant. Every change of the count is a
/// request, whatever its value: any of these clients may write any value. The servant's own requests are in
/// its segment, see ControlFlags.
struct StopSegment {
  static constexpr SegmentKind kKind = SegmentKind::kStop;
  SegmentHeader header;
  alignas(kCacheLine) std::atomic<std::uint64_t> count{0};
};
static_assert(std::is_standard_layout_v<StopSegment>);

/// Reads the newest snapshot that is whole. A task that is killed inside SnapshotCell::store leaves the cell
/// torn until the next store; the flight recorder then still has the previous cycle. False: there has never
/// been a snapshot.
[[nodiscard]] inline bool last_snapshot(const TaskSegment& task, Snapshot& snapshot) noexcept {
  if (task.snapshot.load(snapshot)) return true;
  const std::uint64_t next = task.trace.next();
  for (std::uint64_t back = 1; back <= std::min<std::uint64_t>(next, 2); ++back) {
    if (task.trace.read(next - back, snapshot)) return true;
  }
  return false;
}

}  // namespace corbot
