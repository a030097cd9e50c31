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
#include "robot/robot_view.h"
#include "robot/soft_limits.h"
#include "robot/task_access.h"
#include "robot/ticket_table.h"

namespace corbot {

/// Plans motions one after another, hands them to the real-time task and takes them back. Thread-safe.
/// Nothing here waits for the task with a lock held, or plans with one that a read, a Cancel or other limits need. The calls
/// in here are bounded in number and time.
class MotionQueue {
 public:
  /// How long a call waits until it is known where the arm will rest: behind a Stop or a Cancel that is being
  /// carried out.
  static constexpr double kRestKnown_s = 2.0;

  /// `capacity`: motions that are pending, and calls that start one, at once. The others outlive this.
  MotionQueue(const Planner& planner, int capacity, TicketTable& tickets, const TaskAccess& task,
              const RobotView& view, SoftLimits& limits)
      : planner_(planner),
        capacity_(capacity),
        tickets_(tickets),
        access_(task),
        view_(view),
        limits_(limits) {}

  /// Plans from where the arm will rest when the motion begins, and hands over. A Stop ends it, wherever it
  /// has got to, when it is counted after the request arrived: `arrival`, the number of stops then, or 0,
  /// now.
  /// `admit` is called with that known, and what it returns is kept until the motion is handed over.
  /// `wanted`: while the motion is not handed over.
  corbot_ticket accept(const MotionRequest& request, const PlanSettings& settings, std::uint64_t arrival,
                       const std::function<Control::Use()>& admit, const Wanted& wanted);
  /// Where what is accepted next would begin. Throws CallError (not ready) where that is not known, without waiting.
  [[nodiscard]] PlanStart next_start();
  /// Takes back this motion and what is queued behind it; returns when they have ended. No effect on one that
  /// has ended.
  void cancel(corbot_ticket id, const Wanted& wanted);
  /// Before the first call: what the servants before this one have handed over.
  void inherit(const std::vector<Ticket>& former);
  /// Ends what a Cancel has taken back that was not waited for until the task had echoed it: from a snapshot, as
  /// TicketTable::reconcile.
  void finish_cancel(const Snapshot& before);
  /// The servant before this one may have been killed before the task knew what it was to take back.
  void repeat_cancel();
  /// Throws CallError (not ready) while a motion is pending, of this servant or one before it.
  void check_empty(const LivingTask& task, const Wanted& wanted);
  /// Soft limits for every motion that is handed over from here on, none of which was planned before. Throws CallError:
  /// limit exceeded where the arm stands outside them, not ready while motions are pending.
  void change_limits(const JointRanges& wanted);
  /// Those of the profile: what is pending keeps to narrower ones.
  void reset_limits();
  /// Calls in accept() that have read the number of stops.
  [[nodiscard]] int starting() const noexcept { return starting_.load(); }

 private:
  [[nodiscard]] static bool is_in_error(const LivingTask& task);
  /// Where the arm will rest when what is accepted next begins; nothing while that is not known yet. Throws
  /// when it is not ready.
  [[nodiscard]] std::optional<PlanStart> plan_start(const LivingTask& task, std::uint64_t epoch);
  /// Numbers of the last Stop and of the last Clear when a call began.
  struct Begin {
    std::uint64_t epoch;
    std::uint64_t clears;
  };
  /// Once it is this call's turn: plans and hands over.
  std::optional<corbot_ticket> plan_next(const MotionRequest& request, const PlanSettings& settings,
                                         const LivingTask& task, const Begin& begin);
  /// With the lock of the order.
  corbot_ticket hand_over(const LivingTask& task, std::uint64_t epoch, PlanResult& plan,
                          const PlanStart& start);
  void write_knots(ServantSegment& own, const PlanResult& plan, std::size_t number, Command& command);
  /// With the lock of the order: throws as change_limits().
  void check_limits(const LivingTask& task, const JointRanges& wanted) const;
  std::uint64_t request_cancel(const LivingTask& task, const TicketTable::Range& range);

  const Planner& planner_;
  const int capacity_;
  TicketTable& tickets_;
  const TaskAccess& access_;
  const RobotView& view_;
  SoftLimits& limits_;  // changed with the lock of the order
  std::atomic<int> starting_{0};

  std::mutex cancel_mutex_;             // one request until the task has echoed it; taken before the last
  std::uint64_t unfinished_cancel_{0};  // its number, of that mutex; 0: none
  std::mutex turn_mutex_;               // one plan at a time; taken before the other
  std::mutex order_mutex_;              // of the members below
  std::uint64_t last_pushed_{0};        // to the task below, by this servant or one before it
  std::uint64_t pushed_to_{0};          // incarnation
  std::uint64_t inherited_through_{0};  // numbers of the servants before this one
  std::uint64_t knot_slots_{0};         // of the segment, used in turn
  std::uint64_t last_number_{0};        // given away, whatever the segment: tickets are known by it
};

}  // namespace corbot
