// SPDX-License-Identifier: Apache-2.0
// Implements corbot_robot.h with Robot: control and motions. Converts units and exceptions. No exception
// leaves this file.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <string>
#include <utility>

#include "corbot/arm/joint_units.h"
#include "corbot/motion/bounds.h"
#include "robot/recorded_call.h"

namespace {

using namespace corbot;

/// Describes the caller for the alarm. Returns "" without memory: the stop matters more.
std::string asked_for_by(corbot_robot* robot, const corbot_caller* caller) noexcept {
  std::string by;
  guarded(nullptr, [&] {
    const std::string who = robot->robot.control().name_of(key_of(caller));
    const std::string from = from_of(caller);
    by = who.empty() ? from : fmt::format("'{}' {}", who, from);
  });
  return by;
}

std::array<double, 3> point(const double* p_m) { return {p_m[0], p_m[1], p_m[2]}; }

/// Checks d apart from P, as their sum would hide which of them is wrong.
void check_above(double d_m) {
  if (std::abs(d_m) <= kFarthestCoordinate_m) return;
  throw bad_argument("d", d_m,
                     fmt::format("d = {:.6g} m, allowed -{:.6g} to {:.6g} m", d_m, kFarthestCoordinate_m,
                                 kFarthestCoordinate_m));
}

void check_coordinates(const double* p_m) {
  static constexpr const char* kNames[] = {"Px", "Py", "Pz"};
  for (int i = 0; i < 3; ++i) {
    if (std::abs(p_m[i]) <= kFarthestCoordinate_m) continue;
    throw bad_argument(kNames[i], p_m[i],
                       fmt::format("{} = {:.6g} m, allowed -{:.6g} to {:.6g} m", kNames[i], p_m[i],
                                   kFarthestCoordinate_m, kFarthestCoordinate_m));
  }
}

std::array<double, 3> point_above(const double* p_m, double d_m) {
  check_coordinates(p_m);
  check_above(d_m);
  return {p_m[0], p_m[1], p_m[2] + d_m};
}

/// Longest time until the slot of a disconnected caller is free again: well within a second.
constexpr double kSlice_s = 0.2;

bool is_pending(const corbot_motion_info& info) {
  return info.state == CORBOT_MOTION_QUEUED || info.state == CORBOT_MOTION_RUNNING;
}

/// Waits for the end or for `timeout_s` (negative: without limit). Throws CallError if the caller
/// disconnects.
corbot_motion_info wait_in_slices(const Robot& robot, corbot_ticket ticket, double timeout_s,
                                  const corbot_caller& caller) {
  using Clock = std::chrono::steady_clock;
  const Clock::time_point begin = Clock::now();
  for (;;) {
    const std::chrono::duration<double> waited = Clock::now() - begin;
    const double left_s = timeout_s < 0.0 ? kSlice_s : std::max(0.0, timeout_s - waited.count());
    const corbot_motion_info info = robot.wait(ticket, std::min(left_s, kSlice_s));
    const bool is_last = timeout_s >= 0.0 && left_s <= kSlice_s;
    if (!is_pending(info) || is_last || robot.ends_waits()) return info;
    if (!is_present(&caller)) throw not_ready("the connection of the caller is lost; the motion goes on");
  }
}

}  // namespace

corbot_status corbot_robot_acquire(corbot_robot* robot, const corbot_caller* caller, const char* who,
                                   double lease_s, char key[CORBOT_KEY], corbot_error* error) {
  return recorded(
      robot, caller, error,
      [&](const std::string&) {
        const Wanted wanted = wanted_to_change(
            caller, "no client could take control, because another call came between; call again");
        copy_text(robot->robot.acquire(who, lease_s, wanted), key, CORBOT_KEY);
      },
      "Acquire(\"{:.80}\", {})", who, lease_s);
}

corbot_status corbot_robot_renew(corbot_robot* robot, const corbot_caller* caller, corbot_error* error) {
  return recorded(
      robot, caller, error, [&](const std::string& key) { robot->robot.control().renew(key); }, "Renew()");
}

corbot_status corbot_robot_release(corbot_robot* robot, const corbot_caller* caller, corbot_error* error) {
  return recorded(
      robot, caller, error,
      [&](const std::string& key) { robot->robot.control().release(key, wanted_to_change(caller)); },
      "Release()");
}

corbot_status corbot_robot_end_control(corbot_robot* robot, const corbot_caller* caller,
                                       corbot_error* error) {
  corbot_holder of{};
  corbot_robot_holder(robot, &of);
  return recorded(
      robot, caller, error, [&] { robot->robot.control().end_by_force(); },
      "release --force (control of '{}')", of.who);
}

corbot_status corbot_robot_move(corbot_robot* robot, const corbot_caller* caller, const double p_m[3],
                                double d_m, double t_s, corbot_ticket* ticket, corbot_error* error) {
  return start(
      robot, caller, ticket, error,
      [&] {
        return MoveRequest{point_above(p_m, d_m), t_s};
      },
      "Move({}, {}, {}, {}, {})", p_m[0], p_m[1], p_m[2], d_m, t_s);
}

corbot_status corbot_robot_move_s(corbot_robot* robot, const corbot_caller* caller, const double p_m[3],
                                  double d_m, double t_s, corbot_ticket* ticket, corbot_error* error) {
  return start(
      robot, caller, ticket, error,
      [&] {
        return MoveSRequest{point_above(p_m, d_m), t_s};
      },
      "MoveS({}, {}, {}, {}, {})", p_m[0], p_m[1], p_m[2], d_m, t_s);
}

corbot_status corbot_robot_move_c(corbot_robot* robot, const corbot_caller* caller, const double p1_m[3],
                                  const double p2_m[3], const double p3_m[3], corbot_ticket* ticket,
                                  corbot_error* error) {
  return start(
      robot, caller, ticket, error,
      [&] {
        return MoveCRequest{point(p1_m), point(p2_m), point(p3_m)};
      },
      "MoveC({}, {}, {}, {}, {}, {}, {}, {}, {})", p1_m[0], p1_m[1], p1_m[2], p2_m[0], p2_m[1], p2_m[2],
      p3_m[0], p3_m[1], p3_m[2]);
}

corbot_status corbot_robot_move_joints(corbot_robot* robot, const corbot_caller* caller, const double* target,
                                       size_t count, double t_s, corbot_ticket* ticket, corbot_error* error) {
  std::string targets;
  guarded(nullptr, [&] {
    targets =
        fmt::format("{}", fmt::join(target, target + std::min<std::size_t>(count, CORBOT_MAX_JOINTS), ", "));
  });
  return start(
      robot, caller, ticket, error,
      [&] {
        const Kinematics& arm = robot->robot.profile().arm.kinematics;
        const std::size_t dof = robot->robot.profile().arm.dof;
        if (count != dof) {
          throw bad_argument("target", static_cast<double>(count),
                             fmt::format("target has {} values, but the arm has {} joints", count, dof));
        }
        MoveJointsRequest request{{}, t_s};
        for (std::size_t i = 0; i < count; ++i) {
          request.target_q[i] = from_shown(arm.joint_kind(i), target[i]);
        }
        return request;
      },
      "MoveJoints([{}], {})", targets, t_s);
}

corbot_status corbot_robot_drive(corbot_robot* robot, const corbot_caller* caller, int32_t joint,
                                 double increment, double speed, corbot_ticket* ticket, corbot_error* error) {
  return start(
      robot, caller, ticket, error,
      [&] {
        const ArmModel& arm = robot->robot.profile().arm;
        const bool is_there =
            joint >= 0 && static_cast<std::size_t>(joint) < arm.dof;  // else accept() refuses it
        const JointKind kind =
            is_there ? arm.kinematics.joint_kind(static_cast<std::size_t>(joint)) : JointKind::kRotary;
        return DriveRequest{joint, from_shown(kind, increment), from_shown(kind, speed)};
      },
      "Drive({}, {}, {})", joint, increment, speed);
}

corbot_status corbot_robot_ready(corbot_robot* robot, const corbot_caller* caller, corbot_ticket* ticket,
                                 corbot_error* error) {
  return start(
      robot, caller, ticket, error, [] { return ReadyRequest{}; }, "Ready()");
}

corbot_status corbot_robot_delay(corbot_robot* robot, const corbot_caller* caller, double t_s,
                                 corbot_ticket* ticket, corbot_error* error) {
  return start(
      robot, caller, ticket, error, [&] { return DwellRequest{t_s}; }, "Delay({})", t_s);
}

corbot_status corbot_robot_open_gripper(corbot_robot* robot, const corbot_caller* caller,
                                        corbot_ticket* ticket, corbot_error* error) {
  return start(
      robot, caller, ticket, error, [] { return GripperRequest{1.0}; }, "Open()");
}

corbot_status corbot_robot_close_gripper(corbot_robot* robot, const corbot_caller* caller,
                                         corbot_ticket* ticket, corbot_error* error) {
  return start(
      robot, caller, ticket, error, [] { return GripperRequest{0.0}; }, "Close()");
}

corbot_status corbot_robot_set_gripper(corbot_robot* robot, const corbot_caller* caller, double percent,
                                       corbot_ticket* ticket, corbot_error* error) {
  return start(
      robot, caller, ticket, error,
      [&] {
        if (!(percent >= 0.0 && percent <= 100.0))
          throw bad_argument("percent", percent, fmt::format("{:.6g} percent, allowed 0 to 100", percent));
        return GripperRequest{percent / 100.0};
      },
      "SetGripper({})", percent);
}

corbot_status corbot_robot_wait(corbot_robot* robot, corbot_ticket ticket, double timeout_s,
                                const corbot_caller* caller, corbot_motion_info* info, corbot_error* error) {
  return guarded(error, [&] {
    if (std::isnan(timeout_s)) throw bad_argument("timeout", timeout_s, "the time-out is not a number");
    const auto use = robot->robot.control().try_use(key_of(caller));
    *info = caller != nullptr ? wait_in_slices(robot->robot, ticket, timeout_s, *caller)
                              : robot->robot.wait(ticket, timeout_s);
  });
}

corbot_status corbot_robot_finish(corbot_robot* robot, corbot_ticket ticket, const corbot_caller* caller,
                                  corbot_error* error) {
  return guarded(error, [&] {
    if (caller == nullptr) return robot->robot.finish(ticket);
    const auto use = robot->robot.control().try_use(key_of(caller));
    // A frozen task ends the slices. If the task resumes before is_finished() reads the ticket, the slices
    // resume, too.
    do {
      (void)wait_in_slices(robot->robot, ticket, -1.0, *caller);
    } while (!robot->robot.is_finished(ticket));
  });
}

corbot_counted_stop corbot_robot_count_stop(corbot_robot* robot, int32_t hold) {
  return robot->robot.count_stop(hold != 0);
}

corbot_status corbot_robot_stop(corbot_robot* robot, const corbot_caller* caller, corbot_error* error) {
  return recorded(
      robot, caller, error, [&] { robot->robot.stop(counted_of(caller)); }, "Stop()");
}

corbot_status corbot_robot_stop_and_hold(corbot_robot* robot, const corbot_caller* caller,
                                         corbot_error* error) {
  return recorded(
      robot, caller, error,
      [&] { robot->robot.stop_and_hold(asked_for_by(robot, caller), counted_of(caller)); }, "StopAndHold()");
}

void corbot_robot_request_stop(corbot_robot* robot, const corbot_caller* caller, int32_t hold) {
  if (hold == 0) {
    recorded(
        robot, caller, nullptr, [&] { robot->robot.request_stop(counted_of(caller)); }, "Stop()");
  } else {
    recorded(
        robot, caller, nullptr,
        [&] { robot->robot.request_stop_and_hold(asked_for_by(robot, caller), counted_of(caller)); },
        "StopAndHold()");
  }
}

corbot_status corbot_robot_await_stops(corbot_robot* robot, int32_t hold, corbot_error* error) {
  return guarded(error, [&] { robot->robot.await_requested_stops(hold != 0); });
}

corbot_status corbot_robot_clear(corbot_robot* robot, const corbot_caller* caller, corbot_error* error) {
  return recorded(
      robot, caller, error,
      [&] { robot->robot.clear(wanted_to_change(caller), caller != nullptr ? caller->stops : 0); },
      "Clear()");
}

corbot_status corbot_robot_cancel(corbot_robot* robot, const corbot_caller* caller, corbot_ticket ticket,
                                  corbot_error* error) {
  return change(
      robot, caller, error, [&](Robot& of, const Wanted& wanted) { of.cancel(ticket, wanted); }, "Cancel({})",
      ticket);
}

corbot_status corbot_robot_pause(corbot_robot* robot, const corbot_caller* caller, corbot_error* error) {
  return change(
      robot, caller, error, [](Robot& of, const Wanted& wanted) { of.pause(true, wanted); }, "Pause()");
}

corbot_status corbot_robot_resume(corbot_robot* robot, const corbot_caller* caller, corbot_error* error) {
  return change(
      robot, caller, error, [](Robot& of, const Wanted& wanted) { of.pause(false, wanted); }, "Resume()");
}
