// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <type_traits>

#include "corbot/channel/control_flags.h"
#include "corbot/channel/records.h"
#include "corbot/channel/ring.h"
#include "corbot/channel/servant_state.h"
#include "corbot/channel/snapshot_cell.h"
#include "corbot/channel/trace.h"
#include "corbot/motion/command.h"
#include "corbot/motion/rate_knots.h"
#include "corbot/motion/rate_pieces.h"

// One robot's channel: three segments of shared memory, each with one writer. Whoever else maps one maps it
// read-only, and treats what it reads there as input to be checked.

namespace corbot {

/// "corbot-1" in memory, read from left to right on a little-endian machine.
inline constexpr std::uint64_t kSegmentMagic = 0x312d'746f'6272'6f63;
/// To be raised with every change to a segment or to a record in it.
inline constexpr std::uint32_t kSegmentAbi = 10;
/// Longest name of a robot; letters, digits, '_' and '-'.
inline constexpr std::size_t kMaxSegmentName = 48;

enum class SegmentKind : std::uint32_t { kTask = 1, kServant = 2, kStop = 3 };

/// Written by the creator before any other process has a descriptor of the segment, and never again.
struct SegmentHeader {
  std::uint64_t magic{0};
  std::uint32_t abi{0};
  SegmentKind kind{};
  std::uint64_t total_size{0};   ///< of the creator's layout
  std::uint64_t fingerprint{0};  ///< of the ArmModel, see fingerprint.h
  std::uint64_t id{0};           ///< random: no two segments have the same
  std::int32_t pid{0};           ///< of the creator
  std::uint32_t reserved{0};
  char name[kMaxSegmentName + 8]{};  ///< of the robot, zero-terminated
};

/// Written by the real-time task; a new one for each task, so that no other process ever can.
struct TaskSegment {
  static constexpr SegmentKind kKind = SegmentKind::kTask;
  SegmentHeader header;
  /// Of the real-time task: one more than that of the task whose segment was taken over; else new.
  std::uint64_t incarnation{1};
  /// 1: a task saw an emergency stop and ended before its cycle could latch it; until a clear.
  std::atomic<std::uint32_t> stop_seen{0};
  RingTail<> commands_tail;  ///< of the commands of the servant that is connected
  RingSlots<Completion, 128> completions;
  RingSlots<AlarmEvent, 64> alarms;
  SnapshotCell<Snapshot> snapshot;
  SnapshotCell<LoopDiagnostics> diagnostics;
  alignas(kCacheLine) std::atomic<std::uint32_t> wake{0};  ///< futex word, see wake.h
  Trace trace;
};
static_assert(std::is_standard_layout_v<TaskSegment>);

/// Knots and pieces of one path, before the command that names the slot is published.
struct RateSlot {
  std::array<rate::Knot, kMostKnots> knots;
  std::array<rate::Piece, rate::kMostPieces> pieces;
};
/// One for every command in the ring, one for that which the task is taking, and one to spare: the slots are used in turn, so one
/// is written again only after the task has copied what was in it.
inline constexpr std::size_t kKnotSlots = 66;

/// Written by the servant; a new one for each servant. What outlives a servant is copied by its successor,
/// which receives the former one's segment read-only from the task.
struct ServantSegment {
  static constexpr SegmentKind kKind = SegmentKind::kServant;
  SegmentHeader header;
  ControlFlags control;
  std::atomic<std::uint64_t> next_command_id{1};
  /// Header id of the task's segment that the tails below belong to.
  std::atomic<std::uint64_t> task_id{0};
  RingTail<> completions_tail;
  RingTail<> alarms_tail;
  RingSlots<Command, 64> commands;
  ServantState state;
  std::array<RateSlot, kKnotSlots> rates;
};
static_assert(std::is_standard_layout_v<ServantSegment>);

/// Written by those who may stop the robot without its servant. Every change of the count is a request,
/// whatever its value: any of them may write anything. The servant's own requests are in its segment,
/// see ControlFlags.
struct StopSegment {
  static constexpr SegmentKind kKind = SegmentKind::kStop;
  SegmentHeader header;
  alignas(kCacheLine) std::atomic<std::uint64_t> count{0};
};
static_assert(std::is_standard_layout_v<StopSegment>);

/// The newest snapshot that is whole. A task that is killed inside SnapshotCell::store leaves that cell torn
/// until the next store; then the flight recorder still has the cycle before.
/// False when there has never been one.
[[nodiscard]] inline bool last_snapshot(const TaskSegment& task, Snapshot& snapshot) noexcept {
  if (task.snapshot.load(snapshot)) return true;
  const std::uint64_t next = task.trace.next();
  for (std::uint64_t back = 1; back <= std::min<std::uint64_t>(next, 2); ++back) {
    if (task.trace.read(next - back, snapshot)) return true;
  }
  return false;
}

}  // namespace corbot
