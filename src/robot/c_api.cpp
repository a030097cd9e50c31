// SPDX-License-Identifier: Apache-2.0
// Implements corbot_robot.h with Robot: life cycle and reads. Converts units and exceptions, nothing else. No
// exception leaves this file.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <string>
#include <string_view>
#include <utility>

#include "config/load_profile.h"
#include "corbot/arm/joint_units.h"
#include "corbot/channel/fingerprint.h"
#include "corbot/kinematics/tool_pose.h"
#include "planner/workspace.h"
#include "robot/robot_handle.h"

namespace {
using namespace corbot;
}

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

void corbot_robot_keep_state(corbot_robot* robot, const char* directory, void (*warn)(const char* text)) {
  corbot_error error{};
  guarded(&error, [&] {
    robot->robot.keep_state(directory != nullptr ? directory : "", [warn](const std::string& text) {
      if (warn != nullptr) warn(text.c_str());
    });
  });
  if (error.status != CORBOT_OK && warn != nullptr) warn(error.text);
}

void corbot_robot_serve(corbot_robot* robot, int (*answers)(void* context), void* context) {
  robot->robot.serve([answers, context] { return answers(context) != 0; });
}

void corbot_robot_interrupt(corbot_robot* robot) { robot->robot.interrupt(); }

void corbot_block_release_signal(void) { ReleaseSignal::block(); }

void corbot_robot_heed_release_signal(corbot_robot* robot) {
  robot->release_signal = std::make_unique<ReleaseSignal>([robot](const std::string& from) {
    corbot_caller caller{};
    caller.from = from.c_str();
    (void)corbot_robot_end_control(robot, &caller, nullptr);  // the audit log records the result
  });
}

void corbot_read_key(const void* octets, size_t length, char key[CORBOT_KEY]) {
  constexpr std::string_view kNoKey = "-";
  std::string_view text(static_cast<const char*>(octets), length);
  if (length != CORBOT_KEY - 1 || text.find('\0') != text.npos) text = kNoKey;
  *std::copy(text.begin(), text.end(), key) = '\0';
}

void corbot_robot_describe(const corbot_robot* robot, corbot_description* out) {
  const ArmModel& arm = robot->robot.profile().arm;
  *out = corbot_description{};
  copy_text(robot->name, out->name, sizeof(out->name));
  out->kind = static_cast<int32_t>(arm.kind);
  out->dof = static_cast<int32_t>(arm.dof);
  for (std::size_t i = 0; i < arm.dof; ++i) {
    const JointKind kind = arm.kinematics.joint_kind(i);
    out->lower[i] = tidy_shown(kind, arm.joints[i].lower_q);
    out->upper[i] = tidy_shown(kind, arm.joints[i].upper_q);
    out->speed[i] = tidy_shown(kind, arm.joints[i].speed_q_s);
    out->slides[i] = kind == JointKind::kPrismatic ? 1 : 0;
    copy_text(robot->robot.profile().joint_names[i], out->joint_name[i], sizeof(out->joint_name[i]));
  }
  copy_text(robot->robot.profile().endpoint_host, out->endpoint_host, sizeof(out->endpoint_host));
  out->endpoint_port = robot->robot.profile().port;
  copy_text(CORBOT_VERSION, out->version, sizeof(out->version));
  copy_text(fmt::format("{:016x}", fingerprint(arm)), out->fingerprint, sizeof(out->fingerprint));
  out->started_s = robot->started.count();
  out->reach_m = std::round(reach_m(arm) * 1e9) / 1e9;  // to the nanometre
}

const char* corbot_robot_urdf(const corbot_robot* robot) { return robot->urdf.c_str(); }

corbot_status corbot_robot_joints(const corbot_robot* robot, double out[CORBOT_MAX_JOINTS],
                                  corbot_error* error) {
  return guarded(error, [&] {
    const Joints joints = robot->robot.view().joints_shown();
    std::copy(joints.begin(), joints.end(), out);
  });
}

corbot_status corbot_robot_pose(const corbot_robot* robot, corbot_pose* out, corbot_error* error) {
  return guarded(error, [&] { *out = robot->robot.view().pose(); });
}

corbot_status corbot_robot_arm_state(const corbot_robot* robot, corbot_arm_state* out, corbot_error* error) {
  return guarded(error, [&] {
    *out = robot->robot.view().arm_state();
    corbot_robot_holder(robot, &out->holder);
  });
}

int32_t corbot_robot_soft_limits(const corbot_robot* robot, corbot_joint_ranges* out) {
  *out = corbot_joint_ranges{};
  int32_t known = 0;
  guarded(nullptr, [&] {
    const auto limits = robot->robot.soft_limits();
    for (std::size_t i = 0; limits && i < robot->robot.profile().arm.dof; ++i) {
      const JointKind kind = robot->robot.profile().arm.kinematics.joint_kind(i);
      out->lower[i] = tidy_shown(kind, limits->lower_q[i]);
      out->upper[i] = tidy_shown(kind, limits->upper_q[i]);
    }
    known = limits ? 1 : 0;
  });
  return known;
}

corbot_gripper corbot_robot_gripper(const corbot_robot* robot) { return robot->robot.view().gripper(); }
corbot_state corbot_robot_state(const corbot_robot* robot) { return robot->robot.view().state(); }
double corbot_robot_override(const corbot_robot* robot) { return robot->robot.view().override_percent(); }
int32_t corbot_robot_held(const corbot_robot* robot) { return robot->robot.view().held() ? 1 : 0; }
int32_t corbot_robot_paused(const corbot_robot* robot) { return robot->robot.view().paused() ? 1 : 0; }
double corbot_robot_tool_pitch(const corbot_robot* robot) { return robot->robot.tool_pitch_deg(); }
void corbot_robot_speeds(const corbot_robot* robot, double* tool, double joints[CORBOT_MAX_JOINTS]) {
  const PlanSettings set = robot->robot.settings();
  *tool = 100.0 * set.speed_ratio;
  for (std::size_t i = 0; i < CORBOT_MAX_JOINTS; ++i) joints[i] = 100.0 * set.joint_speed_ratio[i];
}
int32_t corbot_robot_tool_orientation(const corbot_robot* robot, double out[4]) {
  const std::optional<Quaternion> set = robot->robot.tool_orientation();
  const Quaternion q = set.value_or(Quaternion{});
  out[0] = q.w;
  out[1] = q.x;
  out[2] = q.y;
  out[3] = q.z;
  return set ? 1 : 0;
}

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

corbot_status corbot_robot_cycle_age(const corbot_robot* robot, double* out_s, corbot_error* error) {
  return guarded(error, [&] { *out_s = robot->robot.view().cycle_age_s(); });
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

void corbot_robot_holder(const corbot_robot* robot, corbot_holder* out) {
  *out = corbot_holder{};
  guarded(nullptr, [&] {
    const auto holder = robot->robot.control().holder();
    if (!holder) return;
    copy_text(holder->who, out->who, sizeof(out->who));
    out->left_s = holder->left_s;
  });
}
