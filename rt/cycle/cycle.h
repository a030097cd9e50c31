// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <cstdint>

#include "corbot/arm/arm_model.h"
#include "corbot/backend/backend.h"
#include "corbot/backend/emergency_stop.h"
#include "corbot/channel/alarms.h"
#include "corbot/channel/layout.h"
#include "corbot/channel/servant_mailbox.h"
#include "rt/cycle/alarm_output.h"
#include "rt/cycle/command_queue.h"
#include "rt/cycle/governor.h"
#include "rt/cycle/hold_latch.h"
#include "rt/cycle/liveness.h"
#include "rt/cycle/path_evaluation.h"
#include "rt/cycle/position_check.h"
#include "rt/cycle/stop_requests.h"

namespace corbot::rt {

/// What the loop around the cycle must know of a step.
struct StepReport {
  bool published{false};  ///< a verdict, an alarm or a change of state is out: wake the waiting threads
  bool at_rest{true};     ///< no command is running
  RtState state{RtState::kStandby};
};

/// What the cycle works on: its own segment, and what others write. All of it outlives the cycle.
struct CycleChannel {
  TaskSegment& task;
  const std::atomic<std::uint64_t>& stop_count;  ///< of StopSegment
  ServantMailbox& servants;
};

/// Where the arm is when the segment does not say, or is not to be asked.
struct CycleStart {
  Joints position_rad{};  ///< brought into the joints' ranges
  double opening{0.0};
  bool unverified{false};         ///< position unverified: the first motion is slow
  bool outranks_segment{false};   ///< the segment's last snapshot does not say where the servos are
  bool after_gap{false};          ///< the task before was replaced because it was frozen: begin in Error
  bool held{false};               ///< by StopAndHold, as the file on disk says; the segment outranks it
  bool power_cut_at_stop{false};  ///< by an emergency stop: unverified again once it is cleared
  std::uint64_t position_fingerprint{0};  ///< for the snapshots
};

/// One robot's real-time cycle. The constructor adopts the position and the Error of the last snapshot in the
/// task's segment (or the position in `start`); step() is then called once a period, forever.
///
/// step() is given the time and touches nothing but the segment, the backend and its own members: no clock,
/// no allocation, no lock, no system call, nothing thrown, a bounded number of operations. Each call advances
/// the motion by one nominal period; a period that the loop missed delays the motion, it does not make the
/// arm catch up. After a gap (GapWatch) the motion begins again from rest, or is a fault.
class Cycle {
 public:
  /// `stop`: whether an emergency stop is seen, or has been in this process; it and the others outlive this.
  Cycle(const ArmModel& arm, const CycleChannel& channel, Backend& backend, const EmergencyStop& stop,
        const CycleStart& start = {}, const LivenessLimits& limits = {}) noexcept;

  /// Real-time safe, bounded by the size of a ring; step() does it for a servant in the mailbox. What the
  /// former servant was accepted for is carried out first; what the new one's ring holds already is not its
  /// caller's any more, and is dropped. Its flags count from now on.
  void connect(const ServantOffer& offer) noexcept {
    stops_.read(*flags_);  // the former one's last, and its last hold
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

  /// Real-time safe. `now_ns`: CLOCK_MONOTONIC, when the cycle was due;
  /// `wall_ns`: CLOCK_REALTIME of the same instant.
  StepReport step(std::int64_t now_ns, std::int64_t wall_ns) noexcept;

  /// Real-time safe. Brings the running motion to rest and refuses all others; for good.
  void begin_shutdown() noexcept { shutdown_ = true; }
  /// Real-time safe. Time that the machine was suspended, which the time given to step() does not have.
  void count_suspension(std::int64_t ns) noexcept { gap_.add(ns); }
  /// Real-time safe. A period was missed.
  void count_overrun() noexcept { overruns_.add(); }

  /// The frame that describes the present set-point, for Backend::open().
  [[nodiscard]] const ServoFrame& frame() const noexcept { return frame_; }
  /// Any thread. What step() has published last; false before the first.
  [[nodiscard]] bool newest(Snapshot& out) const noexcept {
    return task_.snapshot.load(out) && out.incarnation == task_.incarnation;
  }
  /// A copy of each alarm, for this process to print; consumed by one other thread.
  [[nodiscard]] Ring<AlarmEvent, 64>& alarm_log() noexcept { return alarms_.copies(); }

 private:
  void adopt_last_position(const CycleStart& start) noexcept;
  void inherit_error(bool was_in_error) noexcept;

  void read_flags() noexcept;
  void read_override() noexcept;
  void report_start() noexcept;
  void watch_time() noexcept;
  void watch_servant() noexcept;
  void read_cancel() noexcept;
  void latch_emergency_stop() noexcept;
  void handle_command() noexcept;
  void advance_virtual_time() noexcept;
  [[nodiscard]] SetPoint evaluate_path() noexcept;
  void accept_or_hold(const SetPoint& next) noexcept;
  void exchange_with_backend() noexcept;
  void publish() noexcept;

  [[nodiscard]] bool fetch_command() noexcept;
  void end_stop() noexcept;
  void refuse_queue(Verdict verdict, bool older_only) noexcept;
  void refuse_cancelled() noexcept;
  void end_slowed_down() noexcept;
  void begin_command() noexcept;
  void complete(std::uint64_t id, Verdict verdict) noexcept;
  void refuse(Verdict verdict) noexcept;
  void fault(const AlarmEvent& cause) noexcept;
  void raise(const AlarmEvent& alarm) noexcept;
  [[nodiscard]] bool is_stop_requested() const noexcept;
  [[nodiscard]] bool is_stopping() const noexcept {
    return is_stop_requested() || orphaned_ || hold_.is_slowing_down();
  }
  [[nodiscard]] bool is_taken_back() const noexcept;
  [[nodiscard]] bool is_slowing_down() const noexcept;
  [[nodiscard]] RtState state() const noexcept;

  const ArmModel arm_;
  TaskSegment& task_;
  ServantMailbox& servants_;
  const ControlFlags* flags_{&kNoServant.control};  ///< of the servant that is connected
  Backend& backend_;
  const EmergencyStop& emergency_stop_;
  const double period_s_;

  StopRequests stops_;
  CommandQueue queue_;
  AlarmOutput alarms_;

  GapWatch gap_;
  ServantWatch servant_watch_;
  OverrunCount overruns_;
  HoldLatch hold_;
  PositionCheck position_;
  Governor governor_;
  Command running_{};  ///< valid while is_running_
  bool is_running_{false};
  SetPoint base_{};  ///< where the running command began
  SetPoint set_point_{};
  SetPoint last_{};  ///< of the cycle before

  bool shutdown_{false};
  bool orphaned_{false};  ///< no servant responds: what runs is being stopped
  bool paused_{false};
  bool faulted_{false};
  std::uint32_t presses_seen_{0};
  bool emergency_latched_{false};  ///< until a clear after the release
  bool error_inherited_{false};    ///< of the task before, not yet reported
  bool gap_inherited_{false};      ///< likewise
  bool published_{false};
  BackendHealth health_{BackendHealth::kOpen};
  ServoFrame frame_{};
  Snapshot snapshot_{};
};

}  // namespace corbot::rt
