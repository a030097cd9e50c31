// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <cstdint>
#include <optional>

#include "corbot/arm/arm_model.h"
#include "corbot/backend/backend.h"
#include "corbot/backend/emergency_stop.h"
#include "corbot/channel/alarms.h"
#include "corbot/channel/layout.h"
#include "corbot/channel/servant_mailbox.h"
#include "rt/cycle/alarm_output.h"
#include "rt/cycle/command_queue.h"
#include "rt/cycle/device_watch.h"
#include "rt/cycle/emergency_stop_watch.h"
#include "rt/cycle/fault_stop.h"
#include "rt/cycle/following_check.h"
#include "rt/cycle/grip_watch.h"
#include "rt/cycle/hold_latch.h"
#include "rt/cycle/joint_ramp.h"
#include "rt/cycle/liveness.h"
#include "rt/cycle/motion_rate.h"
#include "rt/cycle/path_check.h"
#include "rt/cycle/path_evaluation.h"
#include "rt/cycle/position_check.h"
#include "rt/cycle/rate_check.h"
#include "rt/cycle/set_point_check.h"
#include "rt/cycle/stop_requests.h"
#include "rt/cycle/workspace_check.h"

namespace corbot::rt {

/// The report of a step to the loop around the cycle.
struct StepReport {
  bool published{false};  ///< a verdict, an alarm or a change of state is out: wake the waiting threads
  bool at_rest{true};     ///< no command is running, and no fault awaits the joints
  RtState state{RtState::kStandby};
};

/// The cycle's data: its own segment, and the data that others write. All of it outlives the cycle.
struct CycleChannel {
  TaskSegment& task;
  const std::atomic<std::uint64_t>& stop_count;  ///< of StopSegment
  ServantMailbox& servants;
};

/// The arm's position if the segment has none, or is not to be used.
struct CycleStart {
  Joints position_q{};  ///< clamped to the joints' ranges
  double opening{0.0};
  bool unverified{false};        ///< position unverified: the first motion is slow
  bool outranks_segment{false};  ///< the segment's last snapshot does not give the servos' positions
  bool after_gap{false};         ///< the previous task was replaced because it was frozen: begin in Error
  bool held{false};              ///< by StopAndHold, from the file on disk; the segment outranks it
  bool in_error{false};          ///< not cleared, from the file on disk; the segment outranks it
  bool was_moved{false};         ///< while no task ran: begin in Error
  bool position_known{false};    ///< also after the servos were without energy
  std::uint64_t position_fingerprint{0};  ///< for the snapshots
};

/// The cycle's settings from the profile.
struct CycleSettings {
  LivenessLimits liveness{};
  int stop_category{1};  ///< of IEC 60204-1: 0 or 1
  /// `[stop] ramp_s`: longest time for which a fault awaits measured joints.
  std::int64_t ramp_ns{1'000'000'000};
  FollowingCheck::Limits following{};
  std::int64_t settle_ns{1'000'000'000};  ///< a motion whose end is not reached within this time is a fault
};

/// One robot's real-time cycle. The constructor adopts the position and the Error of the last snapshot in the
/// task's segment (or the position in `start`). step() is then called once a period, forever.
///
/// The function step() is given the time and accesses only the segment, the backend and its own members. It
/// uses no clock, no allocation, no lock and no system call, throws nothing, and takes a bounded number of
/// operations. Each call advances the motion by one nominal period. A period that the loop missed delays the
/// motion; the arm does not catch up. After a gap (GapWatch) the motion begins again from rest, or it is a
/// fault.
///
/// A fault slows the arm down as FaultStop decides, and then de-energises the servos. Before a Clear nothing
/// gets energy, and nothing moves. Meanwhile the set-point follows the device's report of the joints, so that
/// nothing moves by itself afterwards either.
class Cycle {
 public:
  /// `stop`: the state and the presses of the emergency stop in this process. The cycle adds whether the
  /// thread that watches its inputs still looks. All arguments outlive this.
  Cycle(const ArmModel& arm, const CycleChannel& channel, Backend& backend, EmergencyStop& stop,
        const CycleStart& start = {}, const CycleSettings& settings = {}) noexcept;

  /// Connects a servant. Real-time safe, bounded by the size of a ring; step() calls it for a servant in the
  /// mailbox. The accepted commands of the previous servant are carried out first. The commands already in
  /// the new one's ring no longer belong to its caller, and are dropped. The new servant's flags count from
  /// now on.
  void connect(const ServantOffer& offer) noexcept {
    stops_.read(*flags_);  // the previous servant's last stop, and its last hold
    hold_.see(*flags_);
    if (!queue_.connect(*offer.segment, is_running_)) raise(alarm::ring_corrupt());
    alarms_.follow(offer.segment->alarms_tail);
    flags_ = &offer.segment->control;
    hold_.follow(*flags_);
    snapshot_.clears_done = flags_->clear_count.load(std::memory_order_acquire);
    if (CancelRequest old{}; flags_->cancel.load(old)) snapshot_.cancels_done = old.count;
    snapshot_.servant_session = offer.session;
    servants_.confirm(offer.session);
  }

  /// Real-time safe. `now_ns`: CLOCK_MONOTONIC, the instant the cycle was due. `wall_ns`: CLOCK_REALTIME of
  /// the same instant.
  StepReport step(std::int64_t now_ns, std::int64_t wall_ns) noexcept;

  /// Real-time safe. Brings the running motion to rest and refuses all others, for good.
  void begin_shutdown() noexcept { shutdown_ = true; }
  /// Real-time safe. Adds a suspension of the machine, which the time given to step() does not include.
  void count_suspension(std::int64_t ns) noexcept { gap_.add(ns); }
  /// Real-time safe. Counts a missed period.
  void count_overrun() noexcept { overruns_.add(); }

  /// Returns the frame of the present set-point, for Backend::open().
  [[nodiscard]] const ServoFrame& frame() const noexcept { return frame_; }
  /// Reads the last snapshot of step(); false before the first. For any thread.
  [[nodiscard]] bool newest(Snapshot& out) const noexcept {
    return task_.snapshot.load(out) && out.incarnation == task_.incarnation;
  }
  /// Returns a copy of each alarm, for this process to print; one other thread consumes it.
  [[nodiscard]] Ring<AlarmEvent, 64>& alarm_log() noexcept { return alarms_.copies(); }

 private:
  void adopt_last_position(const CycleStart& start) noexcept;
  void inherit_error(bool was_in_error) noexcept;

  void read_flags() noexcept;
  void read_clear() noexcept;
  void read_override() noexcept;
  void report_start() noexcept;
  void watch_time() noexcept;
  void watch_servant() noexcept;
  void read_cancel() noexcept;
  void watch_stop_input() noexcept;
  void handle_command() noexcept;
  void advance_virtual_time() noexcept;
  [[nodiscard]] SetPoint evaluate_path() noexcept;
  [[nodiscard]] SetPoint evaluate_rate() noexcept;
  void accept_or_ramp(const SetPoint& next) noexcept;
  void step_by_joint() noexcept;
  [[nodiscard]] bool is_led_by_device() const noexcept;
  void follow_device() noexcept;
  void exchange_with_backend() noexcept;
  void watch_device() noexcept;
  void check_following() noexcept;
  void end_settled() noexcept;
  void publish() noexcept;

  [[nodiscard]] std::optional<CommandVerdict> check_knots(const Command& next) noexcept;
  /// Returns false if the waiting command was planned with other shapes than the servant has.
  [[nodiscard]] bool take_workspace() noexcept;
  [[nodiscard]] bool fetch_command() noexcept;
  void end_stop() noexcept;
  void refuse_queue(Verdict verdict, bool older_only) noexcept;
  void refuse_cancelled() noexcept;
  [[nodiscard]] bool is_path_at_rest() const noexcept;
  void end_slowed_down() noexcept;
  [[nodiscard]] bool awaits_device() noexcept;
  [[nodiscard]] bool has_slowed_down() const noexcept;
  [[nodiscard]] bool has_to_be_awaited() const noexcept;
  [[nodiscard]] bool have_joints_come_to_rest() const noexcept;
  [[nodiscard]] bool has_device_seen_rest() const noexcept;
  void end_fault() noexcept;
  void end_motion(Verdict verdict) noexcept;
  void begin_command() noexcept;
  void complete(std::uint64_t id, Verdict verdict) noexcept;
  void refuse(Verdict verdict) noexcept;
  void fault(const AlarmEvent& cause, FaultStop::Way way) noexcept;
  void raise(const AlarmEvent& alarm) noexcept;
  [[nodiscard]] bool is_stop_requested() const noexcept;
  [[nodiscard]] bool is_stopping() const noexcept {
    return is_stop_requested() || orphaned_ || hold_.is_slowing_down();
  }
  [[nodiscard]] bool is_taken_back() const noexcept;
  /// The device gives energy and takes set-points.
  [[nodiscard]] bool is_device_open() const noexcept { return is_open(device_.health()); }
  /// True after a Clear: the servos are energised, and moved to the arm's held position.
  [[nodiscard]] bool is_device_starting() const noexcept {
    return device_.health() == BackendHealth::kStandby && !fault_stop_.is_latched();
  }
  [[nodiscard]] bool is_slowing_down() const noexcept;
  [[nodiscard]] RtState state() const noexcept;

  const ArmModel arm_;
  ArmModel framed_arm_{arm_};  ///< the same, with base and tool of the running or next command
  TaskSegment& task_;
  ServantMailbox& servants_;
  const ControlFlags* flags_{&kNoServant.control};  ///< of the connected servant
  Backend& backend_;
  const double period_s_;
  const std::int64_t settle_ns_;
  const std::int64_t ramp_ns_;

  StopRequests stops_;
  CommandQueue queue_;
  AlarmOutput alarms_;

  GapWatch gap_;
  ServantWatch servant_watch_;
  OverrunCount overruns_;
  HoldLatch hold_;
  PositionCheck position_{kinds_of(arm_.kinematics.chain())};
  EmergencyStopWatch stop_watch_;
  FaultStop fault_stop_;
  JointRamp joint_ramp_;
  FollowingCheck following_;
  RestCheck rest_{kinds_of(arm_.kinematics.chain())};
  GripWatch grip_;
  Settling settling_;
  DeviceWatch device_;
  MotionRate governor_;
  Command running_{};  ///< valid while is_running_
  bool is_running_{false};
  RateCheck rate_check_;
  DifferenceCheck differences_;  ///< along a path
  PathCheck path_check_;         ///< along a path
  WorkspaceCheck workspace_check_;
  SetPoint base_{};  ///< the set-point at which the running command began
  SetPoint set_point_{};
  SetPoint last_{};  ///< of the previous cycle

  bool shutdown_{false};
  bool orphaned_{false};  ///< no servant responds: the running motion is being stopped
  bool paused_{false};
  bool error_inherited_{false};  ///< of the previous task, not yet reported
  bool gap_inherited_{false};    ///< of the previous task, not yet reported
  bool published_{false};
  /// A stop has come while the device was starting: the arm stays where the device reports its servos.
  bool stands_{false};
  /// A joint that would be moved, without energy or while it is being given.
  std::optional<alarm::OutOfRange> beyond_range_{};
  ServoFeedback feedback_{};
  std::int64_t fault_ran_ns_{0};    ///< time since a fault has begun to slow the arm down
  std::int64_t stop_waited_ns_{0};  ///< by awaits_device()
  std::uint64_t moved_in_{0};       ///< the last cycle whose set-points moved the joints or the gripper
  ServoFrame frame_{};
  Snapshot snapshot_{};
};

}  // namespace corbot::rt
