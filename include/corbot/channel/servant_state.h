// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <type_traits>

#include "corbot/channel/durable_cell.h"
#include "corbot/kinematics/joints.h"
#include "corbot/kinematics/pose.h"

// The state that a servant hands to its successor. The servant writes it at each change, since it may be
// killed at any time. The next servant reads it and checks every field (src/robot/inherited_state.h): the
// previous one may have been broken, or hostile. Every record is plain, fixed-size and a multiple of eight
// bytes without padding.

namespace corbot {

/// The settings of Speed, AllSpeed, ArtSpeed, SetToolPitch, SetToolOrientation, SetToolFrame and
/// SetBaseFrame.
struct SettingsRecord {
  double speed_ratio;           ///< (0, 1]
  Joints joint_speed_ratio;     ///< (0, 1]
  std::uint64_t tool_is_set;    ///< SettingsTool
  double tool_pitch_rad;        ///< -pi ... pi
  Quaternion tool_orientation;  ///< unit length
  std::uint64_t frames_set;     ///< bits kSettings…; a frame that is not set is all zero
  Pose tool_frame;              ///< flange_T_tool
  Pose base_frame;              ///< world_T_base
};
inline constexpr std::uint64_t kSettingsToolFrame = 1;
inline constexpr std::uint64_t kSettingsBaseFrame = 2;
/// The operation that has set the tool's orientation.
enum class SettingsTool : std::uint64_t { kNot = 0, kPitch = 1, kOrientation = 2 };
static_assert(std::is_trivially_copyable_v<SettingsRecord> && sizeof(SettingsRecord) % 8 == 0);

/// An alarm as clients read it.
struct AlarmRecord {
  std::uint64_t order;   ///< rises from one alarm to the next; 0: none
  double time_s;         ///< since the Unix epoch
  std::int32_t code;     ///< AlarmCode, or one of the servant's own
  std::uint32_t active;  ///< 1: still the cause of Error
  char text[192];        ///< printable ASCII, terminated
};
static_assert(std::is_trivially_copyable_v<AlarmRecord> && sizeof(AlarmRecord) % 8 == 0);

enum class TicketState : std::uint32_t { kPending = 1, kDone = 2, kStopped = 3, kFailed = 4 };

/// The reason why a motion was stopped or has failed. The first reasons have the numbers of their Verdict.
enum class TicketReason : std::uint32_t {
  kNone = 0,
  kStopped = 2,
  kFault = 3,
  kMalformed = 4,
  kDiscontinuous = 5,
  kLimit = 6,
  kLost = 7,
  kOrphaned = 8,
  kDropped = 9,
  kEnded = 10,
  kTakenBack = 100,   ///< by a Cancel
  kRecordLost = 101,  ///< the motion has ended, and its outcome is lost
  kTaskGone = 102,    ///< the real-time task ended, or was restarted, while it was pending
  kUnknown = 103,     ///< the task gave an unknown verdict
};

/// An accepted motion and its outcome.
struct TicketRecord {
  std::uint64_t first;  ///< number of its first command; 0: no motion
  std::uint64_t last;   ///< number of its last command, by which clients know it
  double duration_s;
  double second_from_s;       ///< when the second command begins, within duration_s
  std::uint64_t incarnation;  ///< number of the real-time task that received it
  std::uint64_t epoch;        ///< number of stops when its call arrived
  Joints end_q;               ///< the arm's rest position when it is done
  double end_gripper;         ///< 0 ... 1
  /// RingSlots::published() once the motion is handed over; 0: a previous servant has handed it over.
  std::uint64_t handed_until;
  TicketState state;
  TicketReason reason;
  std::uint32_t cancelled;  ///< 1: a Cancel has ended it
  std::uint32_t reserved;
};
static_assert(std::is_trivially_copyable_v<TicketRecord> && sizeof(TicketRecord) % 8 == 0);

inline constexpr std::size_t kKeptAlarms = 64;
/// Every pending motion, and the last 1024 that have ended.
inline constexpr std::size_t kKeptTickets = 1024 + 64;

/// Exclusive control of the arm, see src/robot/control.h. Every observer can read it: it holds the proof of a
/// key, not the key.
struct ControlRecord {
  std::array<char, 72> who;                 ///< zero-terminated; empty: no client has control
  std::array<std::uint8_t, 32> key_digest;  ///< SHA-256
  std::int64_t lease_ns;
  std::int64_t until_ns;  ///< CLOCK_MONOTONIC of this boot, as the segment itself
  std::uint64_t in_use;   ///< 1: a call of the holder is under way, and the lease does not run out
};
static_assert(std::is_trivially_copyable_v<ControlRecord> && sizeof(ControlRecord) % 8 == 0);

/// The caller of the last StopAndHold.
struct HoldRecord {
  std::array<char, 128> by;  ///< zero-terminated; empty: not known
};
static_assert(std::is_trivially_copyable_v<HoldRecord> && sizeof(HoldRecord) % 8 == 0);

/// The state in the servant's segment. To add a record, add it here together with its reader.
struct ServantState {
  DurableCell<SettingsRecord> settings;
  std::array<DurableCell<AlarmRecord>, kKeptAlarms> alarms;
  std::array<DurableCell<TicketRecord>, kKeptTickets> tickets;
  DurableCell<ControlRecord> control;
  DurableCell<HoldRecord> hold;
};
static_assert(std::is_standard_layout_v<ServantState>);

}  // namespace corbot
