// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <type_traits>

#include "corbot/kinematics/joints.h"
#include "corbot/kinematics/pose.h"

// The records from the real-time task in the shared-memory channel; motion/command.h has the commands. Every
// record is plain, fixed-size and a multiple of eight bytes without padding.

namespace corbot {

/// The outcome of a command.
enum class Verdict : std::uint32_t {
  kDone = 1,
  kStopped = 2,        ///< a Stop or a Cancel came while it ran, or removed it from the ring
  kFault = 3,          ///< the robot went into Error while it ran or waited
  kMalformed = 4,      ///< a field was not finite, out of range, or of unknown kind
  kDiscontinuous = 5,  ///< start_q is not the arm's rest position
  kLimit = 6,          ///< a law or a target breaks a limit of the arm
  kLost = 7,           ///< it was handed to a previous real-time task
  kOrphaned = 8,       ///< the servant did not respond: stopped on the path, or not begun
  kDropped = 9,  ///< never taken from the ring: corrupt indices, or too many commands of previous servants
  kEnded = 10,   ///< the task was ordered to end: stopped on the path, or not begun
};

struct Completion {
  std::uint64_t id;
  Verdict verdict;
  std::uint32_t reserved;
  std::uint64_t cycle;  ///< loop cycle of the verdict
};

enum class AlarmCode : std::uint32_t {
  kSetPointNotFinite = 100,
  kSetPointOutOfRange = 101,
  kSetPointDiscontinuous = 102,
  kKinematicsFailed = 103,
  kFollowingError = 104,    ///< a joint is too far from its set-point for too long
  kGoalNotReached = 105,    ///< a motion's set-points are at its end, a joint is not
  kJointBeyondRange = 106,  ///< a Clear would move a joint from outside its range: refused, or power is off
  kSetPointTooQuick = 107,
  kSetPointOutsideWorkspace = 108,
  kCommandRefused = 110,
  kRingCorrupt = 111,
  kBackendDegraded = 120,
  kBackendLost = 121,
  kEmergencyStop = 130,
  kErrorInherited = 131,
  kCleared = 132,  ///< no alarm: events before it in the ring no longer cause Error
  kHeld = 133,     ///< stopped by StopAndHold, until a Clear
  kOverrun = 140,
  kLoopGap = 141,
  kTaskReplaced = 142,
  kServantSilent = 143,
};

/// An alarm. The functions of alarms.h write and read it, and define the numbers for each code.
struct AlarmEvent {
  AlarmCode code;
  std::int32_t joint;    ///< −1 if there is none
  std::int64_t time_ns;  ///< CLOCK_REALTIME
  double value;
  double lower;
  double upper;
};

enum class RtState : std::uint32_t { kStandby = 0, kMoving = 1, kPaused = 2, kStopping = 3, kError = 4 };

/// The arm at the end of one cycle. The cycle writes it every time, also into the trace.
struct Snapshot {
  std::uint64_t cycle;
  std::int64_t time_ns;       ///< CLOCK_MONOTONIC: the instant the cycle was due
  std::int64_t wall_ns;       ///< CLOCK_REALTIME of the same instant
  std::uint64_t incarnation;  ///< number of the real-time task
  RtState state;
  std::uint32_t flags;        ///< bits kSnapshot…, below
  std::uint64_t stops_done;   ///< number of the last stop that has been carried out
  std::uint64_t clears_done;  ///< the same for clear_count
  std::uint64_t command_id;   ///< running command, 0 = none
  /// Highest command number that has ended, with its verdict or dropped when a servant connected. Commands
  /// end in the order of their numbers, so every command up to this one has ended, and the number never
  /// falls.
  std::uint64_t last_done_id;
  double virtual_time_s;                    ///< within the running command
  double virtual_rate;                      ///< d(virtual time)/d(time), 0 … 1
  double override_ratio;                    ///< target of the rate when neither paused nor stopping
  double gripper;                           ///< opening set-point, 0 … 1
  Joints position_q;                        ///< set-point
  Joints velocity_q_s;                      ///< difference quotient of the set-point over the cycle
  Joints measured_q;                        ///< from the device, if it can read
  Pose tool;                                ///< base_T_tool: forward kinematics of the set-point
  std::array<double, kMaxServos> pulse_us;  ///< joints first, then the gripper
  std::uint64_t overruns;
  std::uint32_t stop_sources;      ///< bits of StopSource that are active now
  std::uint32_t device_health;     ///< BackendHealth
  std::uint32_t device_cause;      ///< DeviceCause of the device's degradation or loss; 0: neither
  std::uint32_t backlog;           ///< commands that have left the ring and wait in the task
  std::uint64_t device_frames;     ///< number of frames that the device has taken
  std::int64_t device_age_ns;      ///< age of the newest of these frames when the device had taken it
  std::int64_t device_age_max_ns;  ///< the greatest age since the device was opened
  std::int64_t measured_time_ns;   ///< CLOCK_MONOTONIC of measured_q; 0: none
  /// Fingerprint of the mapping of position_q to the servos, see src/state.
  std::uint64_t position_fingerprint;
  std::uint64_t waiting_id;       ///< command that is taken from the ring and not begun, 0 = none
  std::uint64_t cancels_done;     ///< count of the last CancelRequest that is in force
  double command_duration_s;      ///< of the running command, in virtual time; 0 if none runs
  std::uint64_t holds_done;       ///< last value of hold_count that has been carried out
  std::uint64_t servant_session;  ///< connection from which flags and commands are read; 0: none yet
  double measured_opening;        ///< opening of the gripper, 0 ... 1; negative: not measured
};
static_assert(std::is_trivially_copyable_v<Snapshot> && sizeof(Snapshot) % 8 == 0);

inline constexpr std::uint32_t kSnapshotMeasured = 1u;
/// Position unverified: the servos have no encoders and have been without power, or they were calibrated
/// anew. The flag stays until the first motion, which runs slowly, is done.
inline constexpr std::uint32_t kSnapshotUnverified = 2u;
/// A StopAndHold is in force, or is being carried out.
inline constexpr std::uint32_t kSnapshotHeld = 4u;
/// The servos are de-energised until a Clear. position_q follows the joints that the device reports, if it
/// does.
inline constexpr std::uint32_t kSnapshotPowerOff = 8u;
/// A fault is slowing the arm down; the state is already Error.
inline constexpr std::uint32_t kSnapshotFaultStop = 16u;
/// A Pause is in force.
inline constexpr std::uint32_t kSnapshotPaused = 32u;
/// The first flag: the gripper holds something. The second: it holds nothing. Neither: not known.
inline constexpr std::uint32_t kSnapshotHolding = 64u;
inline constexpr std::uint32_t kSnapshotHoldsNothing = 128u;

/// Histogram of the wake-up latency (actual wake-up − due instant). Bucket i counts latencies below
/// latency_edge_ns(i); the last bucket counts the rest.
inline constexpr std::size_t kLatencyBuckets = 64;

struct LoopDiagnostics {
  std::int64_t period_ns;
  std::int64_t since_wall_ns;  ///< start of the counting, CLOCK_REALTIME
  std::uint64_t cycles;
  std::uint64_t overruns;  ///< cycles whose work ended after the next one was due
  std::int64_t latency_max_ns;
  std::int64_t latency_sum_ns;
  std::int64_t work_max_ns;  ///< longest execution of one cycle
  std::uint32_t realtime;    ///< 1: SCHED_FIFO and locked memory; 0: best effort
  std::uint32_t priority;
  std::array<std::uint64_t, kLatencyBuckets> latency;
};
static_assert(std::is_trivially_copyable_v<LoopDiagnostics> && sizeof(LoopDiagnostics) % 8 == 0);

/// Returns the upper edge of bucket i in nanoseconds: 1 µs wide up to 16 µs, then four to an octave up to
/// 65.5 ms.
constexpr std::int64_t latency_edge_ns(std::size_t bucket) noexcept {
  if (bucket < 16) return static_cast<std::int64_t>(bucket + 1) * 1000;
  const std::size_t octave = (bucket - 16) / 4;
  const std::size_t quarter = (bucket - 16) % 4;
  return (std::int64_t{16000} << octave) * static_cast<std::int64_t>(5 + quarter) / 4;
}

}  // namespace corbot
