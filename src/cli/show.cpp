// SPDX-License-Identifier: Apache-2.0
#include "cli/show.h"

#include <fmt/chrono.h>
#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <ctime>
#include <initializer_list>
#include <nlohmann/json.hpp>

#include "cli/frames_view.h"
#include "cli/gripper_view.h"
#include "cli/joint_view.h"
#include "cli/speed_view.h"
#include "client/explain.h"
#include "client/json_view.h"
#include "corbot/channel/alarms.h"
#include "corbot/channel/records.h"
#include "corbot/motion/bounds.h"

namespace corbot::cli {

using client::Client;
using client::device_data;
using client::loop_data;
using client::OnSignal;
using client::printable;
using client::to_string;

namespace {

using nlohmann::json;

constexpr long kTaskGone = 150;  ///< the servant's own alarm
constexpr long kInherited = static_cast<long>(AlarmCode::kErrorInherited);
constexpr long kHeld = static_cast<long>(AlarmCode::kHeld);

/// Returns true if there are alarms, and each has one of these codes.
bool are_all(const std::vector<ActiveAlarm>& alarms, std::initializer_list<long> codes) {
  return !alarms.empty() && std::all_of(alarms.begin(), alarms.end(), [&](const ActiveAlarm& alarm) {
    return std::find(codes.begin(), codes.end(), alarm.code) != codes.end();
  });
}

const char* meaning_of_error(const StatusReport& r, bool cause_gone) {
  const bool is_held =
      r.active_alarms.empty() ? static_cast<bool>(r.control.held) : are_all(r.active_alarms, {kHeld});
  if (is_held) return "held by 'hold', no fault: 'corbot clear' ends the hold";
  if (are_all(r.active_alarms, {kHeld, kInherited}) && !are_all(r.active_alarms, {kInherited}))
    return "held by 'hold', as the last task ended: 'corbot clear' ends the hold";
  if (are_all(r.active_alarms, {kTaskGone})) return "no real-time task runs: this Error ends when one does";
  return cause_gone ? "faulted, and the cause is gone: 'corbot clear' ends the Error"
                    : "faulted: fix the cause, then 'corbot clear'";
}

const char* meaning(const StatusReport& r, bool cause_gone) {
  switch (r.state) {
    case Corbot::Error:
      return meaning_of_error(r, cause_gone);
    case Corbot::Waiting:
      if (r.paused) return "paused, accepted motions wait: 'corbot resume' continues";
      return client::stands_by(r.device) ? "busy: the servos are being brought back"
                                         : "busy: moving or delaying";
    default:
      return "at rest and ready";
  }
}

const char* to_string(Corbot::RobotKind kind) {
  constexpr const char* kNames[] = {"anthropomorphic", "Cartesian", "cylindrical", "polar", "SCARA", "other"};
  const auto index = static_cast<std::size_t>(kind);
  return index < std::size(kNames) ? kNames[index] : "unknown";
}

/// Returns true if the lost device works again, or is on standby. Its alarm stays until it is cleared.
bool is_device_back(const ActiveAlarm& alarm, const Corbot::DeviceInfo& device) {
  return alarm.code == static_cast<long>(AlarmCode::kBackendLost) &&
         (device.health == Corbot::DeviceOpen || device.health == Corbot::DeviceDegraded ||
          client::stands_by(device));
}

/// Returns true if the emergency stop is released. One reading covers all stop inputs of a robot; Clear uses
/// it, too.
bool is_released(const ActiveAlarm& alarm, const Corbot::DeviceInfo& device) {
  return alarm.code == static_cast<long>(AlarmCode::kEmergencyStop) && !device.emergencyStop;
}

/// Describes the device that is back. The text quotes the alarm for the cause, as DeviceInfo no longer
/// contains it.
std::string device_back_text(const ActiveAlarm& alarm) {
  return fmt::format(
      "the servo device was lost and is connected again: 'corbot clear' ends the Error (alarm: {})",
      alarm.text);
}

std::string local_time(double epoch_s) {
  if (!(epoch_s > 0 && epoch_s < 2e11)) return "unknown";
  const auto seconds = static_cast<std::time_t>(epoch_s);
  std::tm parts{};
  localtime_r(&seconds, &parts);
  return fmt::format("{:%Y-%m-%d %H:%M:%S}", parts);
}

std::string microseconds(double seconds) { return fmt::format("{:.1f} us", seconds * 1e6); }

json orientation_data(const std::optional<Corbot::Quaternion>& q) {
  return q ? json{{"w", q->w}, {"x", q->x}, {"y", q->y}, {"z", q->z}} : json();
}

/// Returns true if the reading is older than five of the longest periods that a profile may have.
bool is_old(const StatusReport& report) { return report.cycle_age_s.value_or(0) > 0.1; }

/// Describes the tool pitch of the next move. The row of the tool shows its angles now.
std::string pitch_text(const StatusReport& r) {
  if (r.tool_orientation) return "that of the set orientation";
  if (r.tool_pitch_deg == 0.0 && !client::has_default_pitch(r.kind, r.joints.size()))
    return "kept by the next move";
  return fmt::format("{:g} deg for the next move", rounded(r.tool_pitch_deg, 1e6));
}

/// Returns a row for each frame in force that changes the positions which move takes.
std::string frames_text(const StatusReport::Frames& frames) {
  const auto row = [](const char* name, const Corbot::Pose& frame) {
    return fmt::format("  frame     {}  {}\n", name, frame_text(frame));
  };
  const auto& [tool, base] = frames;
  return (client::has_offset(tool) ? row("tool", tool) : "") +
         (client::has_offset(base) || client::is_turned(base) ? row("base", base) : "");
}

json frame_data(const Corbot::Pose& frame) {
  const Corbot::Point& at = frame.position;
  return {{"x_m", at.x}, {"y_m", at.y}, {"z_m", at.z}, {"orientation", orientation_data(frame.orientation)}};
}

json frames_data(const std::optional<StatusReport::Frames>& frames) {
  return frames ? json{{"tool", frame_data(frames->tool)}, {"base", frame_data(frames->base)}} : json();
}

/// Returns text such as "cell 7, 11.8 s left unless renewed", or "" if no client has control.
std::string holder_text(const Corbot::ControlInfo& control) {
  const std::string holder = printable(control.holder.in());
  return holder.empty() ? "" : fmt::format("{}, {:.1f} s left unless renewed", holder, control.left);
}

/// Takes one consistent reading instead of several.
void take(const Corbot::ArmState& now, StatusReport& report) {
  report.state = now.status;
  report.paused = now.paused;
  report.override_percent = now.overridePercent;
  report.device = now.device;
  report.control = now.control;
  report.cycle_age_s = now.age;
  report.motion = now.motion.id;
  report.progress = now.motion.progress;
  report.gripper_info = now.gripper;
  const Corbot::JointCoord& joints = now.measured ? now.measuredJoints : now.commanded;
  report.joints.assign(joints.get_buffer(), joints.get_buffer() + joints.length());
}

}  // namespace

StatusReport read_status(Client& client) {
  StatusReport report;
  report.name = client.address().name;
  // An IOR may contain the key of exclusive control: like a password, it is not shown.
  report.address = client.address().uri.starts_with("IOR:") ? "the address in the IOR" : client.address().uri;
  client.call([&](auto& arm) {
    report.state = arm.Status();
    report.paused = arm.Paused();
    report.kind = arm.RobotType();
    report.reach_m = arm.Reach();
    report.override_percent = arm.OverridePercent();
    report.tool_pitch_deg = arm.ToolPitch();
    report.gripper = arm.GripperStatus();
    const Corbot::DeviceInfo_var device = arm.Device();
    report.device = device.in();
    try {
      const Corbot::ServantInfo_var servant = arm.Servant();
      report.servant = servant.in();
      const Corbot::ControlInfo_var control = arm.Control();
      report.control = control.in();
      report.cycle_age_s = arm.CycleAge();
    } catch (const CORBA::BAD_OPERATION&) {
      // an older servant: fields that it does not report stay empty
    }
    try {
      const Corbot::JointList_var kinds = arm.Joints();
      for (CORBA::ULong i = 0; i < kinds->length(); ++i)
        report.joint_info.push_back(
            {printable(kinds.in()[i].name.in()), kinds.in()[i].kind == Corbot::JointSlides});
    } catch (const CORBA::BAD_OPERATION&) {
      // an older servant: all joints are rotary
    }
    const Corbot::JointRanges_var ranges = arm.MovRange();
    for (CORBA::ULong i = 0; i < ranges->length(); ++i) report.ranges.push_back(ranges.in()[i]);
    const Corbot::AlarmList_var alarms = arm.Alarms();
    for (CORBA::ULong i = 0; i < alarms->length(); ++i) {
      const auto& alarm = alarms.in()[i];
      if (alarm.active) report.active_alarms.push_back({alarm.code, printable(alarm.text.in())});
    }
    const Corbot::JointCoord_var joints = arm.ArtiCoord();
    for (CORBA::ULong i = 0; i < joints->length(); ++i) report.joints.push_back(joints.in()[i]);
    report.pose = arm.CartCoord();
    try {
      const Corbot::ArmState_var now = arm.State();
      take(now.in(), report);
      const Corbot::JointRanges_var limits = arm.SoftLimits();
      report.soft_limits.assign(limits->get_buffer(), limits->get_buffer() + limits->length());
      const Corbot::ToolOrientationInfo set = arm.ToolOrientation();
      if (set.set) report.tool_orientation = set.orientation;
      const Corbot::SpeedSettings_var speeds = arm.Speeds();
      report.speeds = speeds.in();
      report.frames = {arm.ToolFrame(), arm.BaseFrame()};
    } catch (const CORBA::BAD_OPERATION&) {
      // an older servant: the separate readings stay
    }
  });
  return report;
}

std::string status_text(const StatusReport& r) {
  std::string text = fmt::format("{} ({}, {} joints) at {}\n", r.name.empty() ? "robot" : r.name,
                                 to_string(r.kind), r.joints.size(), r.address);
  bool cause_gone = !r.active_alarms.empty();
  std::string alarms;
  for (const auto& alarm : r.active_alarms) {
    const bool back = is_device_back(alarm, r.device);
    cause_gone = cause_gone && (back || alarm.code == kHeld || is_released(alarm, r.device));
    alarms += fmt::format("  alarm     {} {}\n", alarm.code, back ? device_back_text(alarm) : alarm.text);
  }
  text += fmt::format("  state     {:<9} {}\n{}", to_string(r.state), meaning(r, cause_gone), alarms);
  if (r.motion != 0)
    text += fmt::format("  motion    {}, {:.0f} % done\n", r.motion, rounded(100.0 * r.progress, 1));
  if (is_old(r)) {
    text += fmt::format("  age       {:.1f} s since the last cycle: joints, tool and motion are that old\n",
                        *r.cycle_age_s);
  }
  if (r.control.held) text += "  held      by a StopAndHold: nothing moves until 'corbot clear'\n";
  if (const std::string holder = holder_text(r.control); !holder.empty())
    text += fmt::format("  control   {}\n", holder);
  text += fmt::format("  device    {}\n", client::describe(r.device));
  if (r.device.positionUncertain) {
    text += fmt::format(
        "  position  UNVERIFIED, the servos may have moved: the first motion runs at {:g} % of its speed\n",
        100.0 * kFirstMotionOverride);
  }
  text += fmt::format("  tool      x {:.4f}  y {:.4f}  z {:.4f} m   a {:.2f}  b {:.2f}  c {:.2f} deg\n",
                      rounded(r.pose.x, 1e4), rounded(r.pose.y, 1e4), rounded(r.pose.z, 1e4),
                      rounded(r.pose.a, 100), rounded(r.pose.b, 100), rounded(r.pose.c, 100));
  for (std::size_t i = 0; i < r.joints.size(); ++i) {
    text += fmt::format("  joint {}   {}", i, joint_text(r, i));
    if (i < r.ranges.size()) text += fmt::format("   ({:g} to {:g})", r.ranges[i].lower, r.ranges[i].upper);
    if (is_limited(r, i))
      text += fmt::format("   limited to {:g} to {:g}", r.soft_limits[i].lower, r.soft_limits[i].upper);
    if (i < r.joint_info.size()) text += fmt::format("   {}", r.joint_info[i].name);
    text += '\n';
  }
  text +=
      fmt::format("  gripper   {}\n  speed     {}\n  override  {:g} %\n  pitch     {}\n",
                  gripper_text(r.gripper, r.gripper_info), speeds_text(r), r.override_percent, pitch_text(r));
  // without a shoulder there is no reach
  const std::string frames = r.frames ? frames_text(*r.frames) : "";
  if (r.reach_m > 0.0)
    text += fmt::format("  reach     {:.3f} m from the shoulder{}\n", r.reach_m,
                        frames.empty() ? "" : ", with the profile's tool");
  if (r.tool_orientation) {
    const Corbot::Quaternion& q = *r.tool_orientation;
    text += fmt::format(
        "  set tool  w {:.6g}  x {:.6g}  y {:.6g}  z {:.6g}: the orientation of move, moves, movec\n", q.w,
        q.x, q.y, q.z);
  }
  text += frames;
  if (r.servant.started > 0.0) {
    text += fmt::format("  servant   corbot {}, profile {}, up since {}\n", printable(r.servant.version.in()),
                        printable(r.servant.profile.in()), local_time(r.servant.started));
  }
  return text;
}

std::string status_line(const StatusReport& r) {
  std::string text = fmt::format("{:<7}  x {:8.4f}  y {:8.4f}  z {:8.4f} m  joints", to_string(r.state),
                                 rounded(r.pose.x, 1e4), rounded(r.pose.y, 1e4), rounded(r.pose.z, 1e4));
  for (std::size_t i = 0; i < r.joints.size(); ++i) text += " " + joint_text(r, i);
  const std::string holder = printable(r.control.holder.in());
  const std::string age = is_old(r) ? fmt::format("  age {:.1f} s", *r.cycle_age_s) : "";
  return text + fmt::format("  gripper {}  override {:g} %{}{}{}{}{}\n", to_string(r.gripper),
                            r.override_percent, age, r.paused ? "  paused" : "",
                            r.control.held ? "  held" : "", holder.empty() ? "" : "  control ", holder);
}

std::string status_json(const StatusReport& r) {
  json alarms = json::array();
  for (const auto& alarm : r.active_alarms) alarms.push_back(fmt::format("{} {}", alarm.code, alarm.text));
  const json data{{"name", r.name},
                  {"address", r.address},
                  {"state", to_string(r.state)},
                  {"paused", r.paused},
                  {"cycle_age_s", r.cycle_age_s ? json(*r.cycle_age_s) : json()},
                  {"kind", to_string(r.kind)},
                  {"joints", joints_data(r)},
                  {"tool",
                   {{"x_m", r.pose.x},
                    {"y_m", r.pose.y},
                    {"z_m", r.pose.z},
                    {"a_deg", r.pose.a},
                    {"b_deg", r.pose.b},
                    {"c_deg", r.pose.c}}},
                  {"gripper", to_string(r.gripper)},
                  {"gripper_opening", r.gripper_info ? client::gripper_data(*r.gripper_info) : json()},
                  {"motion", r.motion != 0 ? json{{"ticket", r.motion}, {"progress", r.progress}} : json()},
                  {"reach_m", r.reach_m},
                  {"speed_percent", speeds_data(r)},
                  {"override_percent", r.override_percent},
                  {"tool_pitch_deg", r.tool_pitch_deg},
                  {"tool_orientation", orientation_data(r.tool_orientation)},
                  {"frames", frames_data(r.frames)},
                  {"active_alarms", alarms},
                  {"servant",
                   {{"version", printable(r.servant.version.in())},
                    {"profile", printable(r.servant.profile.in())},
                    {"started_s", r.servant.started}}},
                  {"control",
                   {{"holder", printable(r.control.holder.in())},
                    {"left_s", r.control.left},
                    {"held", static_cast<bool>(r.control.held)}}},
                  {"device", device_data(r.device)}};
  return data.dump(2) + "\n";
}

std::string alarms_text(const Corbot::AlarmList& alarms) {
  if (alarms.length() == 0) return "no alarms\n";
  std::string text;
  for (CORBA::ULong i = 0; i < alarms.length(); ++i) {
    text += fmt::format("{}  {:>4}  {}  {}\n", local_time(alarms[i].time), alarms[i].code,
                        alarms[i].active ? "active" : "      ", printable(alarms[i].text.in()));
  }
  return text;
}

std::string alarms_json(const Corbot::AlarmList& alarms) {
  json list = json::array();
  for (CORBA::ULong i = 0; i < alarms.length(); ++i) {
    list.push_back({{"time_s", alarms[i].time},
                    {"code", alarms[i].code},
                    {"active", static_cast<bool>(alarms[i].active)},
                    {"text", printable(alarms[i].text.in())}});
  }
  return list.dump(2) + "\n";
}

double latency_quantile(const Corbot::LoopInfo& info, double ratio) {
  double total = 0;
  for (CORBA::ULong i = 0; i < info.counts.length(); ++i) total += static_cast<double>(info.counts[i]);
  double below = 0;
  for (CORBA::ULong i = 0; i + 1 < info.counts.length() && i < info.edges.length(); ++i) {
    below += static_cast<double>(info.counts[i]);
    if (total > 0 && below >= ratio * total) return std::min(info.edges[i], info.latencyMax);
  }
  return info.latencyMax;
}

std::string diagnostics_text(const Corbot::LoopInfo& info, const Corbot::DeviceInfo& device) {
  std::string text = fmt::format("loop      {:g} us period, {} cycles since {}\n", info.period * 1e6,
                                 info.cycles, local_time(info.since));
  text += fmt::format("priority  {}\n", info.realTime
                                            ? "real-time (SCHED_FIFO, locked memory)"
                                            : "BEST EFFORT: no real-time privileges; see 'corbot doctor'");
  text += fmt::format("overruns  {}\n", info.overruns);
  text +=
      fmt::format("latency   mean {}, 50 % {}, 99 % {}, 99.9 % {}, max {}\n", microseconds(info.latencyMean),
                  microseconds(latency_quantile(info, 0.5)), microseconds(latency_quantile(info, 0.99)),
                  microseconds(latency_quantile(info, 0.999)), microseconds(info.latencyMax));
  text += fmt::format("work      max {} a cycle\n", microseconds(info.workMax));
  text += fmt::format(
      "device    {}; {} frames accepted, the last {:.1f} ms after its set-point, at most {:.1f} ms\n",
      client::describe(device), device.frames, device.age * 1e3, device.ageMax * 1e3);
  text += device.measured
              ? fmt::format("measured  by the device, {:.1f} ms ago\n", device.measuredAge * 1e3)
              : fmt::format("measured  no{}\n", device.positionUncertain ? "; position unverified" : "");
  unsigned long long most = 0;
  for (CORBA::ULong i = 0; i < info.counts.length(); ++i)
    most = std::max<unsigned long long>(most, info.counts[i]);
  for (CORBA::ULong i = 0; i < info.counts.length() && i < info.edges.length(); ++i) {
    if (info.counts[i] == 0) continue;
    const bool open = i + 1 == info.counts.length();
    const auto bar = static_cast<std::size_t>(
        std::ceil(40.0 * static_cast<double>(info.counts[i]) / static_cast<double>(most)));
    text += fmt::format("  {} {:>9.1f} us {:>12}  {}\n", open ? "beyond " : "up to  ",
                        (open && i > 0 ? info.edges[i - 1] : info.edges[i]) * 1e6, info.counts[i],
                        std::string(bar, '#'));
  }
  return text;
}

std::string diagnostics_json(const Corbot::LoopInfo& info, const Corbot::DeviceInfo& device) {
  json data = loop_data(info);
  data["device"] = device_data(device);
  return data.dump(2) + "\n";
}

void watch(Client& client, const OnSignal& on_signal, double interval_s, int count) {
  const bool terminal = ::isatty(STDOUT_FILENO) == 1;
  for (int shown = 0; count == 0 || shown < count; ++shown) {
    if (shown > 0 && on_signal.wait(interval_s)) break;
    const StatusReport report = read_status(client);
    // Cursor home and clear below instead of clear all avoids flicker.
    const std::string text =
        terminal ? "\x1b[H\x1b[J" + status_text(report) + "\n(Ctrl-C ends)\n" : status_line(report);
    if (std::fwrite(text.data(), 1, text.size(), stdout) != text.size() || std::fflush(stdout) != 0) break;
  }
}

}  // namespace corbot::cli
