// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include "corbot/backend/device_cause.h"
#include "corbot/channel/records.h"
#include "corbot/kinematics/arm_parts.h"

// The alarms of the real-time task: each code has a constructor, and beside it the function that reads the
// fields back. Only this file defines the meaning of an AlarmEvent's numbers. The cycle that publishes the
// event fills in the time. Real-time safe.

namespace corbot::alarm {

namespace detail {

[[nodiscard]] constexpr AlarmEvent event(AlarmCode code, std::int32_t joint = -1, double value = 0.0,
                                         double lower = 0.0, double upper = 0.0) noexcept {
  return {code, joint, 0, value, lower, upper};
}

/// Returns a small number that was stored as a double; 0 if the double holds none.
[[nodiscard]] constexpr std::uint32_t small_number(double value) noexcept {
  return value >= 0.0 && value < 1e6 ? static_cast<std::uint32_t>(value) : 0;
}

/// Returns the verdict with this number; kMalformed if there is none, since the record is malformed then. The
/// switch has no default: the compiler finds a verdict that is missing here.
[[nodiscard]] constexpr Verdict to_verdict(std::uint32_t number) noexcept {
  const auto verdict = static_cast<Verdict>(number);
  switch (verdict) {
    case Verdict::kDone:
    case Verdict::kStopped:
    case Verdict::kFault:
    case Verdict::kMalformed:
    case Verdict::kDiscontinuous:
    case Verdict::kLimit:
    case Verdict::kLost:
    case Verdict::kOrphaned:
    case Verdict::kDropped:
    case Verdict::kEnded:
      return verdict;
  }
  return Verdict::kMalformed;
}

}  // namespace detail

/// `joint` −1 means the gripper's opening. The alarm carries neither value nor bounds; they read 0.
[[nodiscard]] constexpr AlarmEvent set_point_not_finite(std::int32_t joint) noexcept {
  return detail::event(AlarmCode::kSetPointNotFinite, joint);
}

struct OutOfRange {
  std::int32_t joint;  ///< −1: the gripper's opening, 0 … 1, in place of rad or m
  double position_q;
  double lower_q;
  double upper_q;
};
[[nodiscard]] constexpr AlarmEvent set_point_out_of_range(const OutOfRange& what) noexcept {
  return detail::event(AlarmCode::kSetPointOutOfRange, what.joint, what.position_q, what.lower_q,
                       what.upper_q);
}
/// Reads set_point_out_of_range() and joint_beyond_range().
[[nodiscard]] constexpr OutOfRange out_of_range(const AlarmEvent& event) noexcept {
  return {event.joint, event.value, event.lower, event.upper};
}

struct Discontinuity {
  std::int32_t joint;
  double step_q;     ///< step of one cycle, signed
  double allowed_q;  ///< either way
};
[[nodiscard]] constexpr AlarmEvent set_point_discontinuous(const Discontinuity& what) noexcept {
  return detail::event(AlarmCode::kSetPointDiscontinuous, what.joint, what.step_q, -what.allowed_q,
                       what.allowed_q);
}
[[nodiscard]] constexpr Discontinuity discontinuity(const AlarmEvent& event) noexcept {
  return {event.joint, event.value, event.upper};
}

/// Set-points along a path have exceeded a limit although the path's rate keeps the limits of every joint.
struct TooQuick {
  std::int32_t joint;
  std::uint32_t order;  ///< 1 speed, 2 acceleration, 3 jerk
  double value_q;       ///< mean over `order` cycles, signed, in powers of seconds
  double allowed_q;     ///< either way
};
[[nodiscard]] constexpr AlarmEvent set_point_too_quick(const TooQuick& what) noexcept {
  return detail::event(AlarmCode::kSetPointTooQuick, what.joint, what.value_q,
                       static_cast<double>(what.order), what.allowed_q);
}
[[nodiscard]] constexpr TooQuick too_quick(const AlarmEvent& event) noexcept {
  return {event.joint, detail::small_number(event.lower), event.value, event.upper};
}

/// A set-point would put a part of the arm farther beyond a plane or box than the motion's start allows.
struct OutsideWorkspace {
  std::uint32_t shape;  ///< its place in the workspace, from 0
  std::uint32_t part;   ///< of ArmPart
  double clearance_m;   ///< negative
  double least_m;       ///< allowed
};
[[nodiscard]] constexpr AlarmEvent set_point_outside_workspace(const OutsideWorkspace& what) noexcept {
  return detail::event(AlarmCode::kSetPointOutsideWorkspace, -1, what.clearance_m, what.least_m,
                       static_cast<double>(what.shape * kArmParts + what.part));
}
[[nodiscard]] constexpr OutsideWorkspace outside_workspace(const AlarmEvent& event) noexcept {
  const std::uint32_t number = detail::small_number(event.upper);
  constexpr auto kParts = static_cast<std::uint32_t>(kArmParts);
  return {number / kParts, number % kParts, event.value, event.lower};
}

/// A Clear was refused: set-points must begin in the range, and this joint is outside it.
[[nodiscard]] constexpr AlarmEvent joint_beyond_range(const OutOfRange& what) noexcept {
  return detail::event(AlarmCode::kJointBeyondRange, what.joint, what.position_q, what.lower_q, what.upper_q);
}

/// The place on a motion's path without an inverse, in virtual time.
struct KinematicsFailure {
  double time_s;
  double duration_s;  ///< duration of the motion
};
[[nodiscard]] constexpr AlarmEvent kinematics_failed(const KinematicsFailure& what) noexcept {
  return detail::event(AlarmCode::kKinematicsFailed, -1, what.time_s, 0.0, what.duration_s);
}
[[nodiscard]] constexpr KinematicsFailure kinematics_failure(const AlarmEvent& event) noexcept {
  return {event.value, event.upper};
}

struct JointDeviation {
  std::int32_t joint;
  double error_q;    ///< set-point - measured
  double allowed_q;  ///< either way
};
[[nodiscard]] constexpr AlarmEvent following_error(const JointDeviation& what) noexcept {
  return detail::event(AlarmCode::kFollowingError, what.joint, what.error_q, -what.allowed_q, what.allowed_q);
}
[[nodiscard]] constexpr AlarmEvent goal_not_reached(const JointDeviation& what) noexcept {
  return detail::event(AlarmCode::kGoalNotReached, what.joint, what.error_q, -what.allowed_q, what.allowed_q);
}
/// Reads following_error() and goal_not_reached().
[[nodiscard]] constexpr JointDeviation joint_deviation(const AlarmEvent& event) noexcept {
  return {event.joint, event.value, event.upper};
}

struct RefusedCommand {
  std::uint64_t id;
  Verdict verdict;
  std::int32_t joint;  ///< −1 if there is no joint
  double value;        ///< the offending value; its unit depends on the field
};
[[nodiscard]] constexpr AlarmEvent command_refused(const RefusedCommand& what) noexcept {
  return detail::event(AlarmCode::kCommandRefused, what.joint, static_cast<double>(what.id),
                       static_cast<double>(what.verdict), what.value);
}
[[nodiscard]] constexpr RefusedCommand refused_command(const AlarmEvent& event) noexcept {
  constexpr double kLargestId = 9007199254740992.0;  // 2^53: beyond it a double has no units
  const bool is_id = event.value >= 0.0 && event.value <= kLargestId;
  return {is_id ? static_cast<std::uint64_t>(event.value) : 0,
          detail::to_verdict(detail::small_number(event.lower)), event.joint, event.upper};
}

[[nodiscard]] constexpr AlarmEvent ring_corrupt() noexcept { return detail::event(AlarmCode::kRingCorrupt); }

[[nodiscard]] constexpr AlarmEvent backend_degraded(DeviceCause cause) noexcept {
  return detail::event(AlarmCode::kBackendDegraded, -1, static_cast<double>(to_number(cause)));
}
[[nodiscard]] constexpr AlarmEvent backend_lost(DeviceCause cause) noexcept {
  return detail::event(AlarmCode::kBackendLost, -1, static_cast<double>(to_number(cause)));
}
/// Reads backend_degraded() and backend_lost().
[[nodiscard]] constexpr DeviceCause backend_cause(const AlarmEvent& event) noexcept {
  return to_device_cause(detail::small_number(event.value));
}

/// `sources`: bits of StopSource; 0 for a press that was over when the cycle checked.
[[nodiscard]] constexpr AlarmEvent emergency_stop(std::uint32_t sources) noexcept {
  return detail::event(AlarmCode::kEmergencyStop, -1, static_cast<double>(sources));
}
[[nodiscard]] constexpr std::uint32_t emergency_stop_sources(const AlarmEvent& event) noexcept {
  return detail::small_number(event.value);
}

[[nodiscard]] constexpr AlarmEvent error_inherited() noexcept {
  return detail::event(AlarmCode::kErrorInherited);
}

/// The arm has come to rest for a StopAndHold.
[[nodiscard]] constexpr AlarmEvent held() noexcept { return detail::event(AlarmCode::kHeld); }

struct Overruns {
  std::uint64_t count;  ///< since the last such alarm
  std::uint64_t total;  ///< since the task's start
};
[[nodiscard]] constexpr AlarmEvent overrun(const Overruns& what) noexcept {
  return detail::event(AlarmCode::kOverrun, -1, static_cast<double>(what.count), 0.0,
                       static_cast<double>(what.total));
}
[[nodiscard]] constexpr Overruns overruns(const AlarmEvent& event) noexcept {
  return {detail::small_number(event.value), detail::small_number(event.upper)};
}

/// The loop made no step for this time.
[[nodiscard]] constexpr AlarmEvent loop_gap(std::int64_t gap_ns) noexcept {
  return detail::event(AlarmCode::kLoopGap, -1, static_cast<double>(gap_ns) * 1e-9);
}
[[nodiscard]] constexpr double gap_s(const AlarmEvent& event) noexcept { return event.value; }

/// This task replaced a task that was frozen.
[[nodiscard]] constexpr AlarmEvent task_replaced() noexcept {
  return detail::event(AlarmCode::kTaskReplaced);
}

/// The servant's beat stood still while a motion ran or was queued.
[[nodiscard]] constexpr AlarmEvent servant_silent() noexcept {
  return detail::event(AlarmCode::kServantSilent);
}

/// The Clear of this number ended Error. The event's place in the ring separates the alarms before and after
/// it.
[[nodiscard]] constexpr AlarmEvent cleared(std::uint64_t clears) noexcept {
  return detail::event(AlarmCode::kCleared, -1, static_cast<double>(clears));
}
[[nodiscard]] constexpr std::uint64_t cleared_count(const AlarmEvent& event) noexcept {
  constexpr double kLargest = 9007199254740992.0;  // 2^53: beyond it a double has no units
  return event.value >= 0.0 && event.value <= kLargest ? static_cast<std::uint64_t>(event.value) : 0;
}

}  // namespace corbot::alarm
