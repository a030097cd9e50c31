// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "config/profile.h"
#include "robot/alarm_log.h"
#include "robot/call_error.h"
#include "robot/link.h"
#include "robot/settings.h"
#include "robot/task_watch.h"
#include "robot/ticket_table.h"

namespace corbot {

/// The reads of a robot, from the newest snapshot, the tickets and the alarms. They never wait for a plan or
/// a motion. Thread-safe. Units as in corbot_robot.h.
class RobotView {
 public:
  /// All arguments must outlive this.
  RobotView(const Profile& profile, const Link& link, const TaskWatch& watch, const TicketTable& tickets,
            const AlarmLog& alarms, const Settings& settings)
      : profile_(profile),
        link_(link),
        watch_(watch),
        tickets_(tickets),
        alarms_(alarms),
        settings_(settings) {}

  [[nodiscard]] Snapshot snapshot() const;  ///< throws CallError (no data) when there has never been one
  [[nodiscard]] Joints joints_shown() const;
  /// Returns the pose in the frames in force, like arm_state().
  [[nodiscard]] corbot_pose pose() const;
  [[nodiscard]] corbot_gripper gripper() const;
  [[nodiscard]] corbot_state state() const;
  /// Returns the present age of the newest snapshot; throws like snapshot().
  [[nodiscard]] double cycle_age_s() const;
  [[nodiscard]] LoopDiagnostics diagnostics() const;
  [[nodiscard]] corbot_device_info device() const;
  /// Returns the state in one snapshot, without exclusive control, which is not known here. Throws like
  /// snapshot().
  [[nodiscard]] corbot_arm_state arm_state() const;
  [[nodiscard]] double override_percent() const;
  /// Returns true while a Pause is in force; only Resume ends it.
  [[nodiscard]] bool paused() const;
  /// Returns true while a StopAndHold is in force or requested; only Clear ends it.
  [[nodiscard]] bool held() const;
  [[nodiscard]] std::vector<AlarmEntry> alarms() const;
  [[nodiscard]] corbot_motion_info describe(const Ticket& ticket) const;
  /// Returns why the robot is in Error, and what to do about it.
  [[nodiscard]] std::string error_cause() const;

 private:
  [[nodiscard]] corbot_state state_of(const Snapshot& now, std::size_t pending) const;
  /// `from_ns`: CLOCK_MONOTONIC, the instant from which ages count.
  [[nodiscard]] corbot_device_info device_of(const Snapshot& now, std::int64_t from_ns) const;
  [[nodiscard]] bool is_held(const Snapshot* now) const;
  [[nodiscard]] corbot_motion_info motion_of(const Snapshot& now, const std::optional<Ticket>& ticket) const;

  const Profile& profile_;
  const Link& link_;
  const TaskWatch& watch_;
  const TicketTable& tickets_;
  const AlarmLog& alarms_;
  const Settings& settings_;  // its frames apply to every pose
};

}  // namespace corbot
