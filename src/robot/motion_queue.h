// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "planner/planner.h"
#include "robot/control.h"
#include "robot/further_workspace.h"
#include "robot/robot_view.h"
#include "robot/task_access.h"
#include "robot/ticket_table.h"

namespace corbot {

/// Plans motions one after another, hands them to the real-time task and cancels them. No function waits for
/// the task with a lock held. No function plans with a lock that a read, a Cancel or a change of limits
/// needs. The number and the duration of the calls in progress are bounded. Thread-safe.
class MotionQueue {
 public:
  /// Longest wait of a call until the arm's rest position is known, after a Stop or a Cancel.
  static constexpr double kRestKnown_s = 2.0;

  /// `capacity`: largest number of pending motions, and of concurrent calls that start one. The other
  /// arguments outlive this.
  MotionQueue(const Planner& planner, int capacity, TicketTable& tickets, const TaskAccess& task,
              const RobotView& view, SoftLimits& limits, FurtherWorkspace& shapes)
      : planner_(planner),
        capacity_(capacity),
        tickets_(tickets),
        access_(task),
        view_(view),
        limits_(limits),
        shapes_(shapes) {}

  /// Plans from the position at which the arm will rest when the motion begins, and hands the motion over. A
  /// Stop that is counted after the request arrived ends the call at any point. `arrival`: number of stops
  /// when the request arrived; 0: it arrives now. The call uses `admit` after it has read the number of
  /// stops, and keeps the result until the hand-over. `wanted`: abort check until the hand-over.
  corbot_ticket accept(const MotionRequest& request, const PlanSettings& settings, std::uint64_t arrival,
                       const std::function<Control::Use()>& admit, const Wanted& wanted);
  /// Returns the start of the motion that would be accepted next. Throws CallError (not ready) if the start
  /// is not known; never waits.
  [[nodiscard]] PlanStart next_start();
  /// Cancels this motion and all queued behind it; returns when they have ended. No effect on a motion that
  /// has ended.
  void cancel(corbot_ticket id, const Wanted& wanted);
  /// Takes over the motions that previous servants handed over. Called before the first call.
  void inherit(const std::vector<Ticket>& former);
  /// Ends cancelled motions whose Cancel returned before the task had echoed it. `before` as in
  /// TicketTable::reconcile.
  void finish_cancel(const Snapshot& before);
  /// Repeats the previous servant's Cancel, as that servant may have been killed before the task read the
  /// request.
  void repeat_cancel();
  /// Throws CallError (not ready) while a motion of this servant or a previous one is pending.
  void check_empty(const LivingTask& task, const Wanted& wanted);
  /// Sets soft limits for every motion handed over from now on; each of them is planned with these limits.
  /// Throws CallError: limit exceeded if the arm is outside the limits, not ready while motions are pending.
  void change_limits(const JointRanges& wanted);
  /// Restores the profile's limits. Pending motions may continue, as they keep to narrower limits.
  void reset_limits();
  /// Sets further planes and boxes; nothing: none. Throws like change_limits(), and also for a reset while
  /// motions are pending: the task has one place for the shapes of all pending motions. `settings`: the
  /// frames in force.
  void change_shapes(const std::optional<FurtherShapes>& wanted, const PlanSettings& settings);
  /// Returns the number of calls in accept() that have read the number of stops.
  [[nodiscard]] int starting() const noexcept { return starting_.load(); }

 private:
  [[nodiscard]] static bool is_in_error(const LivingTask& task);
  /// Returns the position at which the arm will rest when the next accepted motion begins, or nothing while
  /// the position is not known. Throws if the robot is not ready.
  [[nodiscard]] std::optional<PlanStart> plan_start(const LivingTask& task, std::uint64_t epoch);
  /// Numbers of the last Stop and the last Clear when a call began.
  struct Begin {
    std::uint64_t epoch;
    std::uint64_t clears;
  };
  /// Plans and hands over when it is this call's turn.
  std::optional<corbot_ticket> plan_next(const MotionRequest& request, const PlanSettings& settings,
                                         const LivingTask& task, const Begin& begin);
  /// The caller holds order_mutex_.
  corbot_ticket hand_over(const LivingTask& task, std::uint64_t epoch, PlanResult& plan,
                          const PlanStart& start, const FurtherShapes& shapes);
  static void write_shapes(ServantSegment& own, const FurtherShapes& shapes);
  void write_knots(ServantSegment& own, const PlanResult& plan, std::size_t number, Command& command);
  using Check = std::function<std::optional<PlanRefusal>(const Joints& position_q)>;
  /// The caller holds order_mutex_. Throws not ready while motions are pending, and a refusal by the check.
  void check_rest(const LivingTask& task, const Check& check) const;
  /// Changes a setting while nothing is pending and the check of the arm's position allows it.
  template <class Setting>
  void change(Setting& setting, const std::optional<typename Setting::Value>& wanted, const Check& check);
  std::uint64_t request_cancel(const LivingTask& task, const TicketTable::Range& range);

  const Planner& planner_;
  const int capacity_;
  TicketTable& tickets_;
  const TaskAccess& access_;
  const RobotView& view_;
  SoftLimits& limits_;        // changed with order_mutex_ held
  FurtherWorkspace& shapes_;  // the same
  std::atomic<int> starting_{0};

  std::mutex cancel_mutex_;  // one request until the task has echoed it; locked before order_mutex_
  std::uint64_t unfinished_cancel_{0};  // number of that request, guarded by cancel_mutex_; 0: none
  std::mutex turn_mutex_;               // one plan at a time; locked before order_mutex_
  std::mutex order_mutex_;              // guards the members below
  std::uint64_t last_pushed_{
      0};  // last command pushed to the task pushed_to_, by this servant or a previous one
  std::uint64_t pushed_to_{0};          // incarnation of that task
  std::uint64_t inherited_through_{0};  // last number of the previous servants
  std::uint64_t knot_slots_{0};         // slots of the segment used so far; they are used in turn
  std::uint64_t last_number_{0};        // last number issued in any segment: tickets are known by it
};

}  // namespace corbot
