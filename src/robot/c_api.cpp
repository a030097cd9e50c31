// SPDX-License-Identifier: Apache-2.0
// corbot_robot.h over Robot: conversion of units and of exceptions, nothing else.
// Nothing thrown leaves this file.
#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <memory>
#include <string>
#include <utility>

#include "config/load_profile.h"
#include "corbot/channel/fingerprint.h"
#include "corbot/motion/bounds.h"
#include "corbot/units.h"
#include "robot/control.h"
#include "robot/corbot_robot.h"
#include "robot/robot.h"
#include "shm/segment_error.h"

struct corbot_robot {
  corbot_robot(corbot::Profile profile, std::string robot_name)
      : name(std::move(robot_name)), robot(std::move(profile), name) {}
  std::string name;
  const std::chrono::duration<double> started{std::chrono::system_clock::now().time_since_epoch()};
  corbot::Robot robot;
  corbot::Control control{[] {}};
};

namespace {

using namespace corbot;

/// Runs `body` and turns what it throws into a status.
template <class Body>
corbot_status guarded(corbot_error* error, Body&& body) noexcept {
  corbot_error ignored{};
  corbot_error& out = error != nullptr ? *error : ignored;
  out = corbot_error{};
  out.joint = -1;
  try {
    body();
  } catch (const CallError& refused) {
    out = refused.error;
  } catch (const std::exception& exception) {
    out.status = CORBOT_INTERNAL;
    copy_text(exception.what(), out.text, sizeof(out.text));
  } catch (...) {
    out.status = CORBOT_INTERNAL;
    copy_text("unknown exception", out.text, sizeof(out.text));
  }
  return out.status;
}

std::array<double, 3> point(const double* p_m) { return {p_m[0], p_m[1], p_m[2]}; }

/// `make` checks what only the C interface can, and returns the request.
template <class Make>
corbot_status start(corbot_robot* robot, const corbot_caller* caller, corbot_ticket* ticket,
                    corbot_error* error, Make&& make) noexcept {
  return guarded(error,
                 [&] { *ticket = robot->robot.accept(make(), caller != nullptr ? caller->stops : 0); });
}

/// P and d are checked apart: their sum would hide which of them is at fault.
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

/// How soon the place of a caller who is gone is free again: well within a second.
constexpr double kSlice_s = 0.2;

bool is_pending(const corbot_motion_info& info) {
  return info.state == CORBOT_MOTION_QUEUED || info.state == CORBOT_MOTION_RUNNING;
}

/// Waits for the end, for `timeout_s` (negative: for ever), or until the caller is gone, which throws.
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
    if (caller.present != nullptr && caller.present(caller.context) == 0)
      throw not_ready("the connection of the caller is lost; the motion goes on");
  }
}

}  // namespace

corbot_robot* corbot_robot_open(const char* profile_path, const char* name, corbot_error* error) {
  std::unique_ptr<corbot_robot> robot;
  guarded(error, [&] {
    Profile profile = load_profile(profile_path);
    std::string robot_name = name != nullptr ? name : profile.name;
    robot = std::make_unique<corbot_robot>(std::move(profile), std::move(robot_name));
  });
  return robot.release();
}

void corbot_robot_close(corbot_robot* robot) { delete robot; }

void corbot_robot_save_position(corbot_robot* robot, const char* directory, void (*warn)(const char* text)) {
  corbot_error error{};
  guarded(&error, [&] {
    robot->robot.save_position(directory != nullptr ? directory : "", [warn](const std::string& text) {
      if (warn != nullptr) warn(text.c_str());
    });
  });
  if (error.status != CORBOT_OK && warn != nullptr) warn(error.text);
}

void corbot_robot_serve(corbot_robot* robot, int (*answers)(void* context), void* context) {
  robot->robot.serve([answers, context] { return answers(context) != 0; });
}

void corbot_robot_interrupt(corbot_robot* robot) { robot->robot.interrupt(); }

void corbot_robot_describe(const corbot_robot* robot, corbot_description* out) {
  const ArmModel& arm = robot->robot.profile().arm;
  *out = corbot_description{};
  copy_text(robot->name, out->name, sizeof(out->name));
  out->kind = static_cast<int32_t>(arm.kind);
  out->dof = static_cast<int32_t>(arm.dof);
  for (std::size_t i = 0; i < arm.dof; ++i) {
    out->lower_deg[i] = tidy_degrees(arm.joints[i].lower_rad);
    out->upper_deg[i] = tidy_degrees(arm.joints[i].upper_rad);
  }
  copy_text(robot->robot.profile().endpoint_host, out->endpoint_host, sizeof(out->endpoint_host));
  out->endpoint_port = robot->robot.profile().port;
  copy_text(CORBOT_VERSION, out->version, sizeof(out->version));
  copy_text(fmt::format("{:016x}", fingerprint(arm)), out->fingerprint, sizeof(out->fingerprint));
  out->started_s = robot->started.count();
  out->reach_m = arm.geometry.l1_m + arm.geometry.l2_m + arm.geometry.l3_m;
}

corbot_status corbot_robot_joints(const corbot_robot* robot, double out_deg[CORBOT_MAX_JOINTS],
                                  corbot_error* error) {
  return guarded(error, [&] {
    const Joints joints = robot->robot.view().joints_deg();
    std::copy(joints.begin(), joints.end(), out_deg);
  });
}

corbot_status corbot_robot_pose(const corbot_robot* robot, corbot_pose* out, corbot_error* error) {
  return guarded(error, [&] { *out = robot->robot.view().pose(); });
}

corbot_gripper corbot_robot_gripper(const corbot_robot* robot) { return robot->robot.view().gripper(); }
corbot_state corbot_robot_state(const corbot_robot* robot) { return robot->robot.view().state(); }
double corbot_robot_override(const corbot_robot* robot) { return robot->robot.view().override_percent(); }
int32_t corbot_robot_paused(const corbot_robot* robot) { return robot->robot.view().paused() ? 1 : 0; }
double corbot_robot_tool_pitch(const corbot_robot* robot) { return robot->robot.tool_pitch_deg(); }

size_t corbot_robot_alarms(const corbot_robot* robot, corbot_alarm out[CORBOT_MAX_ALARMS]) {
  size_t count = 0;
  guarded(nullptr, [&] {
    for (const AlarmEntry& entry : robot->robot.view().alarms()) {
      if (count == CORBOT_MAX_ALARMS) break;
      corbot_alarm& alarm = out[count++];
      alarm.time_s = entry.time_s;
      alarm.code = entry.code;
      alarm.active = entry.active ? 1 : 0;
      copy_text(entry.text, alarm.text, sizeof(alarm.text));
    }
  });
  return count;
}

corbot_status corbot_robot_loop_info(const corbot_robot* robot, corbot_loop_info* out, corbot_error* error) {
  return guarded(error, [&] {
    const LoopDiagnostics loop = robot->robot.view().diagnostics();
    *out = corbot_loop_info{};
    out->period_s = static_cast<double>(loop.period_ns) * 1e-9;
    out->since_s = static_cast<double>(loop.since_wall_ns) * 1e-9;
    out->cycles = loop.cycles;
    out->overruns = loop.overruns;
    const double cycles = static_cast<double>(std::max<std::uint64_t>(loop.cycles, 1));
    out->latency_mean_s = static_cast<double>(loop.latency_sum_ns) * 1e-9 / cycles;
    out->latency_max_s = static_cast<double>(loop.latency_max_ns) * 1e-9;
    out->work_max_s = static_cast<double>(loop.work_max_ns) * 1e-9;
    out->realtime = static_cast<int32_t>(loop.realtime);
    static_assert(CORBOT_LATENCY_BUCKETS == kLatencyBuckets);
    for (std::size_t i = 0; i < kLatencyBuckets; ++i) {
      out->counts[i] = loop.latency[i];
      out->edges_s[i] = static_cast<double>(latency_edge_ns(i)) * 1e-9;
    }
  });
}

corbot_status corbot_robot_device_info(const corbot_robot* robot, corbot_device_info* out,
                                       corbot_error* error) {
  return guarded(error, [&] { *out = robot->robot.view().device(); });
}

void corbot_robot_stops(const corbot_robot* robot, uint64_t* all, uint64_t* by_others) {
  const StopCounts stops = robot->robot.stops();
  *all = stops.all;
  *by_others = stops.by_others;
}

corbot_status corbot_robot_move(corbot_robot* robot, const corbot_caller* caller, const double p_m[3],
                                double d_m, double t_s, corbot_ticket* ticket, corbot_error* error) {
  return start(robot, caller, ticket, error, [&] { return MoveRequest{point_above(p_m, d_m), t_s}; });
}

corbot_status corbot_robot_move_s(corbot_robot* robot, const corbot_caller* caller, const double p_m[3],
                                  double d_m, double t_s, corbot_ticket* ticket, corbot_error* error) {
  return start(robot, caller, ticket, error, [&] { return MoveSRequest{point_above(p_m, d_m), t_s}; });
}

corbot_status corbot_robot_move_c(corbot_robot* robot, const corbot_caller* caller, const double p1_m[3],
                                  const double p2_m[3], const double p3_m[3], corbot_ticket* ticket,
                                  corbot_error* error) {
  return start(robot, caller, ticket, error, [&] {
    return MoveCRequest{point(p1_m), point(p2_m), point(p3_m)};
  });
}

corbot_status corbot_robot_move_joints(corbot_robot* robot, const corbot_caller* caller,
                                       const double* target_deg, size_t count, double t_s,
                                       corbot_ticket* ticket, corbot_error* error) {
  return start(robot, caller, ticket, error, [&] {
    const std::size_t dof = robot->robot.profile().arm.dof;
    if (count != dof) {
      throw bad_argument("target", static_cast<double>(count),
                         fmt::format("{} values, but the arm has {} joints", count, dof));
    }
    MoveJointsRequest request{{}, t_s};
    for (std::size_t i = 0; i < count; ++i) request.target_rad[i] = to_radians(target_deg[i]);
    return request;
  });
}

corbot_status corbot_robot_drive(corbot_robot* robot, const corbot_caller* caller, int32_t joint,
                                 double increment_deg, double speed_deg_s, corbot_ticket* ticket,
                                 corbot_error* error) {
  return start(robot, caller, ticket, error, [&] {
    return DriveRequest{joint, to_radians(increment_deg), to_radians(speed_deg_s)};
  });
}

corbot_status corbot_robot_ready(corbot_robot* robot, const corbot_caller* caller, corbot_ticket* ticket,
                                 corbot_error* error) {
  return start(robot, caller, ticket, error, [] { return ReadyRequest{}; });
}

corbot_status corbot_robot_delay(corbot_robot* robot, const corbot_caller* caller, double t_s,
                                 corbot_ticket* ticket, corbot_error* error) {
  return start(robot, caller, ticket, error, [&] { return DwellRequest{t_s}; });
}

corbot_status corbot_robot_open_gripper(corbot_robot* robot, const corbot_caller* caller,
                                        corbot_ticket* ticket, corbot_error* error) {
  return start(robot, caller, ticket, error, [] { return GripperRequest{1.0}; });
}

corbot_status corbot_robot_close_gripper(corbot_robot* robot, const corbot_caller* caller,
                                         corbot_ticket* ticket, corbot_error* error) {
  return start(robot, caller, ticket, error, [] { return GripperRequest{0.0}; });
}

corbot_status corbot_robot_wait(corbot_robot* robot, corbot_ticket ticket, double timeout_s,
                                const corbot_caller* caller, corbot_motion_info* info, corbot_error* error) {
  return guarded(error, [&] {
    if (std::isnan(timeout_s)) throw bad_argument("timeout", timeout_s, "the time-out is not a number");
    *info = caller != nullptr ? wait_in_slices(robot->robot, ticket, timeout_s, *caller)
                              : robot->robot.wait(ticket, timeout_s);
  });
}

corbot_status corbot_robot_finish(corbot_robot* robot, corbot_ticket ticket, const corbot_caller* caller,
                                  corbot_error* error) {
  return guarded(error, [&] {
    if (caller == nullptr) return robot->robot.finish(ticket);
    // A frozen task ends the slices; where it goes on before the ticket is looked at, so do they.
    do {
      (void)wait_in_slices(robot->robot, ticket, -1.0, *caller);
    } while (!robot->robot.is_finished(ticket));
  });
}

corbot_status corbot_robot_stop(corbot_robot* robot, const corbot_caller* /*caller*/, corbot_error* error) {
  return guarded(error, [&] { robot->robot.stop(); });
}
void corbot_robot_request_stop(corbot_robot* robot) {
  guarded(nullptr, [&] { robot->robot.request_stop(); });
}
corbot_status corbot_robot_await_stops(corbot_robot* robot, corbot_error* error) {
  return guarded(error, [&] { robot->robot.await_requested_stops(); });
}
corbot_status corbot_robot_cancel(corbot_robot* robot, const corbot_caller* /*caller*/, corbot_ticket ticket,
                                  corbot_error* error) {
  return guarded(error, [&] { robot->robot.cancel(ticket); });
}
corbot_status corbot_robot_pause(corbot_robot* robot, const corbot_caller* /*caller*/, corbot_error* error) {
  return guarded(error, [&] { robot->robot.pause(true); });
}
corbot_status corbot_robot_resume(corbot_robot* robot, const corbot_caller* /*caller*/, corbot_error* error) {
  return guarded(error, [&] { robot->robot.pause(false); });
}
corbot_status corbot_robot_set_override(corbot_robot* robot, const corbot_caller* /*caller*/, double percent,
                                        corbot_error* error) {
  return guarded(error, [&] { robot->robot.set_override(percent); });
}
corbot_status corbot_robot_clear(corbot_robot* robot, const corbot_caller* /*caller*/, corbot_error* error) {
  return guarded(error, [&] { robot->robot.clear(); });
}

corbot_status corbot_robot_speed(corbot_robot* robot, const corbot_caller* /*caller*/, double percent,
                                 corbot_error* error) {
  return guarded(error, [&] { robot->robot.set_speed(percent); });
}
corbot_status corbot_robot_art_speed(corbot_robot* robot, const corbot_caller* /*caller*/, int32_t joint,
                                     double percent, corbot_error* error) {
  return guarded(error, [&] { robot->robot.set_joint_speed(joint, percent); });
}
corbot_status corbot_robot_all_speed(corbot_robot* robot, const corbot_caller* /*caller*/, double percent,
                                     corbot_error* error) {
  return guarded(error, [&] { robot->robot.set_all_speeds(percent); });
}
corbot_status corbot_robot_set_tool_pitch(corbot_robot* robot, const corbot_caller* /*caller*/,
                                          double degrees, corbot_error* error) {
  return guarded(error, [&] { robot->robot.set_tool_pitch(degrees); });
}

corbot_status corbot_robot_acquire(corbot_robot* robot, const corbot_caller* /*caller*/, const char* who,
                                   double lease_s, char key[CORBOT_KEY], corbot_error* error) {
  return guarded(error, [&] { copy_text(robot->control.acquire(who, lease_s), key, CORBOT_KEY); });
}
corbot_status corbot_robot_renew(corbot_robot* robot, const corbot_caller* caller, corbot_error* error) {
  return guarded(error, [&] { robot->control.renew(caller->key); });
}
corbot_status corbot_robot_release(corbot_robot* robot, const corbot_caller* caller, corbot_error* error) {
  return guarded(error, [&] { robot->control.release(caller->key); });
}
void corbot_robot_holder(const corbot_robot* robot, corbot_holder* out) {
  *out = corbot_holder{};
  guarded(nullptr, [&] {
    const auto holder = robot->control.holder();
    if (!holder) return;
    copy_text(holder->who, out->who, sizeof(out->who));
    out->left_s = holder->left_s;
  });
}
corbot_status corbot_robot_stop_and_hold(corbot_robot* robot, const corbot_caller* caller,
                                         corbot_error* error) {
  return corbot_robot_stop(robot, caller, error);
}
int32_t corbot_robot_held(const corbot_robot* /*robot*/) { return 0; }
