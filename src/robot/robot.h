// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <atomic>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "config/profile.h"
#include "planner/frame_settings.h"
#include "planner/planner.h"
#include "planner/pose_solutions.h"
#include "planner/reasons.h"
#include "robot/alarm_log.h"
#include "robot/audit_log.h"
#include "robot/call_error.h"
#include "robot/control.h"
#include "robot/link.h"
#include "robot/motion_queue.h"
#include "robot/position_saver.h"
#include "robot/robot_view.h"
#include "robot/self_check.h"
#include "robot/settings.h"
#include "robot/soft_limits.h"
#include "robot/task_access.h"
#include "robot/task_watch.h"
#include "robot/ticket_table.h"

namespace corbot {

struct StopCounts {
  std::uint64_t all{};
  std::uint64_t by_others{};  ///< counted by other processes
};

/// A motion that was planned and not accepted.
struct MotionPlan {
  Joints start_q{}, end_q{};
  std::vector<rate::PlanPart> parts;
};

/// The robot without an ORB. Plans whole motions one after another, hands them to the real-time task and
/// keeps a ticket of each. Thread-safe. Units as in corbot_robot.h; refused calls throw CallError.
class Robot final : private LinkListener {
 public:
  /// Throws SegmentError when another servant serves this robot.
  Robot(Profile profile, const std::string& name);
  Robot(const Robot&) = delete;
  Robot& operator=(const Robot&) = delete;
  ~Robot() override;

  [[nodiscard]] const Profile& profile() const noexcept { return profile_; }

  /// From now on the last position is saved on disk, and calls are recorded in the audit log; empty: in the default
  /// directory. `warn` is called when that fails, from threads of its own.
  void keep_state(const std::string& directory, PositionSaver::Warn warn);
  /// Without effect before keep_state().
  void record(const AuditEntry& call) const noexcept;

  /// Calls are served from now on. `answers` is called again and again, from a thread of its own, until
  /// interrupt(): whether one gets through. What depends on that: the beat for the real-time task, and what
  /// the supervisor of this process hears.
  void serve(std::function<bool()> answers) { self_check_.start(std::move(answers)); }

  /// Every call that waits for a motion returns: the servant is shutting down.
  void interrupt();
  /// No wait waits: that is so, or the real-time task is frozen.
  [[nodiscard]] bool ends_waits() const noexcept { return task_.is_closing() || watch_.is_frozen(); }

  /// What can be read; never waits for a motion, nor for one being planned.
  [[nodiscard]] const RobotView& view() const noexcept { return view_; }

  /// Checks the arguments, plans from where the arm will rest when the motion begins, with the present
  /// settings, and hands over. A bad argument is refused first, whether the robot is ready or not.
  /// `arrival`: the number of stops when the request arrived; 0: it arrives now.
  /// `key`: of the caller's reference, see Control. `wanted`, here and below: while the call waits.
  corbot_ticket accept(const MotionRequest& request, std::uint64_t arrival = 0, const std::string& key = {},
                       const Wanted& wanted = {});
  /// Plans as accept() would now, and hands nothing over. Throws CallError; waits for no motion.
  [[nodiscard]] MotionPlan plan(const MotionRequest& request);
  /// So far; takes no lock.
  [[nodiscard]] StopCounts stops() const;

  [[nodiscard]] corbot_motion_info wait(corbot_ticket ticket, double timeout_s) const;
  void finish(corbot_ticket ticket) const;
  /// Without waiting. False: still under way; otherwise as finish().
  [[nodiscard]] bool is_finished(corbot_ticket ticket) const;
  /// Takes back a motion and what is queued behind it; what is before it goes on.
  void cancel(corbot_ticket ticket, const Wanted& wanted = {});
  /// Calls that are starting a motion.
  [[nodiscard]] int starting() const noexcept { return queue_.starting(); }

  /// Exclusive control. Everything below but stop(), stop_and_hold() and clear() needs a Control::Use while it lasts.
  [[nodiscard]] Control& control() noexcept { return control_; }
  [[nodiscard]] const Control& control() const noexcept { return control_; }
  /// Not ready where no real-time task is connected, and while motions are pending: they are another's.
  [[nodiscard]] std::string acquire(const std::string& who, double lease_s, const Wanted& wanted);

  // Pre-emption: flags in the segment, no lock that a plan holds.
  /// corbot_robot_count_stop says what this does. The calls below take the result, and count what is not counted.
  [[nodiscard]] corbot_counted_stop count_stop(bool hold = false) noexcept;
  void stop(const corbot_counted_stop& counted = {}, const Wanted& wanted = {});
  /// stop() and stop_and_hold() in two halves, for many at once: the first does not wait; the second returns at rest,
  /// when all that were requested before it are carried out.
  void request_stop(const corbot_counted_stop& counted = {});
  void request_stop_and_hold(std::string by, const corbot_counted_stop& counted = {});
  void await_requested_stops(bool hold = false);
  /// And holds until clear(), across restarts; where no task is connected, the next one is held. `by`: for the alarm.
  void stop_and_hold(std::string by, const corbot_counted_stop& counted = {});
  void pause(bool on, const Wanted& wanted = {});
  void set_override(double percent, const Wanted& wanted = {});
  void clear(const Wanted& wanted = {});

  // Settings for the motions planned from now on.
  void set_speed(double percent);
  void set_joint_speed(int joint, double percent);
  void set_all_speeds(double percent);
  [[nodiscard]] PlanSettings settings() const { return settings_.get(); }
  void set_tool_pitch(double degrees);
  [[nodiscard]] double tool_pitch_deg() const;
  /// For arms that follow every orientation; of unit length within 1e-6.
  void set_tool_orientation(const Quaternion& orientation);
  /// Takes back what this and set_tool_pitch() have set.
  void reset_tool_orientation();
  [[nodiscard]] std::optional<Quaternion> tool_orientation() const {
    return settings_.get().tool_orientation;
  }

  /// Flange to tool centre point, and where the arm stands in the frame of all positions, instead of the profile's; for what is
  /// planned from now on, and what is read.
  void set_tool_frame(const Pose& flange_T_tool);
  void set_base_frame(const Pose& world_T_base);
  void reset_frames();
  [[nodiscard]] Frames frames() const;

  /// All solutions at a pose, turns counted from where the arm stands; throws CallError: bad argument, unreachable.
  [[nodiscard]] std::vector<PoseSolution> solutions(const Pose& pose) const;
  /// Of the set-points; nothing where the family has no closed form. Throws CallError (no data).
  [[nodiscard]] std::optional<std::uint32_t> solution() const;

  /// Ranges within the profile's that planned motions keep, degrees or m; kept on disk. Throws CallError for what no arm has,
  /// where the arm stands outside, while motions are pending, and where they cannot be saved.
  void set_soft_limits(const JointRanges& limits);
  void reset_soft_limits();
  /// Those in force, rad or m; nothing: not known, and no joint moves until they are set or reset.
  [[nodiscard]] std::optional<JointRanges> soft_limits() const { return limits_.ranges(); }

 private:
  /// Throws the refusal, where there is one.
  void check_setting(const std::optional<PlanRefusal>& refusal) const;
  corbot_counted_stop count_now(std::uint64_t hold) noexcept;
  std::uint64_t count_hold() noexcept;
  void await_stop(const LivingTask& task, const corbot_counted_stop& stop, const Wanted& wanted);
  void await_counted(const corbot_counted_stop& stop, const Wanted& wanted);
  void await_all_requested(bool hold);
  void await_hold(std::uint64_t count);
  /// Returns where the motion is done, throws CallError otherwise.
  void report_end(const std::optional<Ticket>& ticket) const;
  void on_completion(const Completion& completion) override;
  void on_alarm(const AlarmEvent& alarm) override;
  void on_lost(const std::string& reason) override;
  void on_attached(bool again) override;
  void on_drained(const Snapshot& before) override;
  void on_inherit(const Inheritance& inheritance) override;

  /// Whatever a call may have to wait for can be had.
  [[nodiscard]] bool responds();
  void on_frozen(bool frozen);
  void set_holds_cleared(std::uint64_t count);
  void await_reports(const std::atomic<std::uint64_t>& clears, std::uint64_t count, const LivingTask& task,
                     const Wanted& wanted);
  void set_held_by(std::string by, bool was_counted = false);
  void add_held_alarm(const AlarmEvent& alarm);
  void record_end(const Ticket& ticket) const;
  std::string end_control(const Control::Ending& ending) noexcept;

  const Profile profile_;
  const std::string name_;
  const Planner planner_;
  SoftLimits limits_;
  TicketTable tickets_;
  AlarmLog alarms_{kinds_of(profile_.arm.kinematics.chain())};
  std::atomic<std::uint64_t> own_stops_{0};        ///< that this has counted
  std::atomic<std::uint64_t> clears_reported_{0};  ///< number of the last Clear that was reported
  std::atomic<std::uint64_t> clears_drained_{0};   ///< all alarms up to this one have been taken

  std::mutex requested_mutex_;  // of the two below
  corbot_counted_stop requested_{};
  std::uint64_t requested_hold_{0};

  SelfCheck self_check_;
  Link link_;          // its thread uses all of the above, and the settings
  Settings settings_;  // kept in the link's segment
  TaskWatch watch_;    // likewise, and the link
  const RobotView view_;
  TaskAccess task_;
  MotionQueue queue_;
  std::unique_ptr<PositionSaver> saver_;  // reads from the link
  std::mutex held_by_mutex_;              // of held_by_, its copy for the next servant, and unnamed_alarm_
  std::string held_by_;
  std::string unnamed_alarm_;          ///< text of the alarm of a hold that had no name yet; empty: none
  std::atomic<int> unnamed_holds_{0};  ///< counted, and not named yet
  Control control_;                    // its thread stops the arm
  std::unique_ptr<AuditLog> audit_log_;
  std::atomic<AuditLog*> audit_{nullptr};  // the same, once it is there
};

}  // namespace corbot
