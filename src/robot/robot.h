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
#include "corbot/arm/shape_numbers.h"
#include "corbot/arm/shape_parts.h"
#include "planner/frame_settings.h"
#include "planner/planner.h"
#include "planner/pose_solutions.h"
#include "planner/reasons.h"
#include "robot/alarm_log.h"
#include "robot/audit_log.h"
#include "robot/call_error.h"
#include "robot/control.h"
#include "robot/further_workspace.h"
#include "robot/link.h"
#include "robot/motion_queue.h"
#include "robot/position_saver.h"
#include "robot/robot_view.h"
#include "robot/self_check.h"
#include "robot/settings.h"
#include "robot/task_access.h"
#include "robot/task_watch.h"
#include "robot/ticket_table.h"

namespace corbot {

struct StopCounts {
  std::uint64_t all{};
  std::uint64_t by_others{};  ///< counted by other processes
};

/// A motion that was planned but not accepted.
struct MotionPlan {
  Joints start_q{}, end_q{};
  std::vector<rate::PlanPart> parts;
};

/// A plane or box that a client sets, in the numbers of the interface.
struct WantedShape {
  std::string name;
  ShapeKind kind{};
  std::uint32_t parts{};
  ShapeNumbers numbers;
};

/// The robot without an ORB. Plans whole motions one after another, hands them to the real-time task and
/// keeps a ticket of each. Thread-safe. Units as in corbot_robot.h. Refused calls throw CallError.
class Robot final : private LinkListener {
 public:
  /// Throws SegmentError if another servant serves this robot.
  Robot(Profile profile, const std::string& name);
  Robot(const Robot&) = delete;
  Robot& operator=(const Robot&) = delete;
  ~Robot() override;

  [[nodiscard]] const Profile& profile() const noexcept { return profile_; }

  /// Saves the last position on disk from now on and records calls in the audit log; "": in the default
  /// directory. If that fails, threads of their own call `warn`.
  void keep_state(const std::string& directory, PositionSaver::Warn warn);
  /// No effect before keep_state().
  void record(const AuditEntry& call) const noexcept;

  /// Reports that calls are served from now on. A separate thread calls `answers` repeatedly until
  /// interrupt(). `answers` returns true if a call gets through. The beat for the real-time task and the
  /// notifications to the supervisor of this process depend on the result.
  void serve(std::function<bool()> answers) { self_check_.start(std::move(answers)); }

  /// Ends every wait for a motion: the servant is shutting down.
  void interrupt();
  /// Returns true if no call may wait: the robot is shutting down, or the real-time task is frozen.
  [[nodiscard]] bool ends_waits() const noexcept { return task_.is_closing() || watch_.is_frozen(); }

  /// Returns the reads, which never wait for a motion or for a plan in progress.
  [[nodiscard]] const RobotView& view() const noexcept { return view_; }

  /// Checks the arguments, plans from the position at which the arm will rest when the motion begins, with
  /// the present settings, and hands over. Refuses a bad argument first, whether or not the robot is ready.
  /// `arrival`: number of stops when the request arrived; 0: it arrives now. `key`: key in the caller's
  /// reference, see Control. `wanted`, here and below: abort check of the call's waits.
  corbot_ticket accept(const MotionRequest& request, std::uint64_t arrival = 0, const std::string& key = {},
                       const Wanted& wanted = {});
  /// Plans as accept() would now, but hands nothing over. Throws CallError. Waits for no motion.
  [[nodiscard]] MotionPlan plan(const MotionRequest& request);
  /// Returns the number of stops so far. Takes no lock.
  [[nodiscard]] StopCounts stops() const;

  [[nodiscard]] corbot_motion_info wait(corbot_ticket ticket, double timeout_s) const;
  void finish(corbot_ticket ticket) const;
  /// Does not wait. Returns false while the motion is under way; otherwise like finish().
  [[nodiscard]] bool is_finished(corbot_ticket ticket) const;
  /// Cancels a motion and all queued behind it; earlier motions continue.
  void cancel(corbot_ticket ticket, const Wanted& wanted = {});
  /// Returns the number of calls that are starting a motion.
  [[nodiscard]] int starting() const noexcept { return queue_.starting(); }

  /// Exclusive control. All functions below except stop(), stop_and_hold() and clear() need a Control::Use
  /// during the call.
  [[nodiscard]] Control& control() noexcept { return control_; }
  [[nodiscard]] const Control& control() const noexcept { return control_; }
  /// Takes control. Throws not_ready if no real-time task is connected, and while motions are pending: they
  /// belong to another client.
  [[nodiscard]] std::string acquire(const std::string& who, double lease_s, const Wanted& wanted);

  // Pre-emption by flags in the segment, without any lock that a plan holds.
  /// Counts a stop like corbot_robot_count_stop. The calls below take the result, and count the stop
  /// themselves if it is not counted.
  [[nodiscard]] corbot_counted_stop count_stop(bool hold = false) noexcept;
  void stop(const corbot_counted_stop& counted = {}, const Wanted& wanted = {});
  /// stop() and stop_and_hold() in two halves, for many robots at once. The first half does not wait. The
  /// second returns at rest, when all stops that were requested before it are carried out.
  void request_stop(const corbot_counted_stop& counted = {});
  void request_stop_and_hold(std::string by, const corbot_counted_stop& counted = {});
  void await_requested_stops(bool hold = false);
  /// Stops and holds until clear(), across restarts. If no task is connected, the next one is held. `by`:
  /// text for the alarm.
  void stop_and_hold(std::string by, const corbot_counted_stop& counted = {});
  void pause(bool on, const Wanted& wanted = {});
  void set_override(double percent, const Wanted& wanted = {});
  /// `arrival`: as accept()'s. A hold that was counted since is not ended.
  void clear(const Wanted& wanted = {}, std::uint64_t arrival = 0);

  // Settings for the motions planned from now on.
  void set_speed(double percent);
  void set_joint_speed(int joint, double percent);
  void set_all_speeds(double percent);
  [[nodiscard]] PlanSettings settings() const { return settings_.get(); }
  void set_tool_pitch(double degrees);
  [[nodiscard]] double tool_pitch_deg() const;
  /// Sets an orientation of unit length within 1e-6, for arms that can follow every orientation.
  void set_tool_orientation(const Quaternion& orientation);
  /// Undoes set_tool_orientation() and set_tool_pitch().
  void reset_tool_orientation();
  [[nodiscard]] std::optional<Quaternion> tool_orientation() const {
    return settings_.get().tool_orientation;
  }

  /// Set flange to tool centre point, and the arm's base in the frame of all positions, instead of the
  /// profile's frames. They apply to reads and to motions planned from now on.
  void set_tool_frame(const Pose& flange_T_tool);
  void set_base_frame(const Pose& world_T_base);
  void reset_frames();
  [[nodiscard]] Frames frames() const;

  /// Returns all solutions at a pose; turns count from the present position of the arm. Throws CallError: bad
  /// argument, unreachable.
  [[nodiscard]] std::vector<PoseSolution> solutions(const Pose& pose) const;
  /// Returns the solution of the set-points, or nothing if the family has no closed form. Throws CallError
  /// (no data).
  [[nodiscard]] std::optional<std::uint32_t> solution() const;

  /// Sets ranges within the profile's, in degrees or m, that planned motions keep, and saves them on disk.
  /// Throws CallError for invalid ranges, if the arm is outside them, while motions are pending, and if they
  /// cannot be saved.
  void set_soft_limits(const JointRanges& limits);
  void reset_soft_limits();
  /// Returns the limits in force, in rad or m, or nothing if they are not known. No joint moves then until
  /// they are set or reset.
  [[nodiscard]] std::optional<JointRanges> soft_limits() const;

  /// Sets planes and boxes that planned motions keep beside the profile's, and saves them on disk. At most
  /// FurtherShapes::kMostShapes. Throws CallError for invalid ones, if the arm stands beyond one, while
  /// motions are pending, and if they cannot be saved.
  void set_workspace(const std::vector<WantedShape>& wanted);
  /// Removes them. Throws CallError while motions are pending.
  void reset_workspace();
  /// Returns the planes and boxes that are set, or nothing if they are not known, or hold for another base
  /// frame. No joint moves then until they are set or reset, or that base frame is set.
  [[nodiscard]] std::optional<FurtherShapes> further_shapes() const;

 private:
  /// Throws the refusal, if there is one.
  void check_setting(const std::optional<PlanRefusal>& refusal) const;
  /// Returns the settings with the soft limits and the further planes and boxes.
  [[nodiscard]] PlanSettings settings_in_force() const;
  corbot_counted_stop count_now(std::uint64_t hold) noexcept;
  std::uint64_t count_hold() noexcept;
  void await_stop(const LivingTask& task, const corbot_counted_stop& stop, const Wanted& wanted);
  void await_counted(const corbot_counted_stop& stop, const Wanted& wanted);
  void await_all_requested(bool hold);
  void await_hold(std::uint64_t count);
  /// Returns if the motion is done, throws CallError otherwise.
  void report_end(const std::optional<Ticket>& ticket) const;
  void on_completion(const Completion& completion) override;
  void on_alarm(const AlarmEvent& alarm) override;
  void on_lost(const std::string& reason) override;
  void on_attached(bool again) override;
  void on_drained(const Snapshot& before) override;
  void on_inherit(const Inheritance& inheritance) override;

  /// Returns true if every lock that a call may wait for can be acquired.
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
  FurtherWorkspace shapes_;
  TicketTable tickets_;
  AlarmLog alarms_{kinds_of(profile_.arm.kinematics.chain()), shape_names(profile_.arm.workspace)};
  std::atomic<std::uint64_t> own_stops_{0};        ///< stops that this servant has counted
  std::atomic<std::uint64_t> clears_reported_{0};  ///< number of the last Clear that was reported
  std::atomic<std::uint64_t> clears_drained_{
      0};  ///< number of the last Clear up to which all alarms have been read

  std::mutex requested_mutex_;  // guards the two members below
  corbot_counted_stop requested_{};
  std::uint64_t requested_hold_{0};

  SelfCheck self_check_;
  Link link_;          // its thread uses all members above, and the settings
  Settings settings_;  // kept in the link's segment
  TaskWatch watch_;    // kept in the link's segment; uses the link, too
  const RobotView view_;
  TaskAccess task_;
  MotionQueue queue_;
  std::unique_ptr<PositionSaver> saver_;  // reads from the link
  std::mutex held_by_mutex_;  // guards held_by_, its copy for the next servant, and unnamed_alarm_
  std::string held_by_;
  std::string unnamed_alarm_;          ///< text of a hold's alarm that was added without the name; "": none
  std::atomic<int> unnamed_holds_{0};  ///< holds that are counted and have no name yet
  Control control_;                    // its thread stops the arm
  std::unique_ptr<AuditLog> audit_log_;
  std::atomic<AuditLog*> audit_{nullptr};  // audit_log_.get() once the log exists
};

}  // namespace corbot
