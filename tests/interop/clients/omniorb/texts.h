// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <fmt/format.h>

#include <arm.hh>
#include <string>
#include <utility>

// Results, written by type.

inline std::string text(double value) { return fmt::format("{}", value); }
inline std::string text(CORBA::Long value) { return fmt::format("{}", value); }
inline std::string text(CORBA::ULongLong value) { return fmt::format("{}", value); }
inline std::string text(bool value) { return value ? "true" : "false"; }
inline std::string text(const char* value) {
  std::string quoted = "\"";
  for (const char* c = value; *c != '\0'; ++c) {
    if (*c == '"' || *c == '\\') quoted += '\\';
    quoted += *c;
  }
  return quoted + '"';
}
inline std::string text(Corbot::GripperState value) { return value == Corbot::Open ? "Open" : "Close"; }
inline std::string text(Corbot::RobotState value) {
  static constexpr const char* kNames[] = {"Error", "Waiting", "Standby"};
  return kNames[value];
}
inline std::string text(Corbot::RobotKind value) {
  static constexpr const char* kNames[] = {"Anthropomorphic", "Cartesian", "Cylindrical",
                                           "Polar",           "Scara",     "Other"};
  return kNames[value];
}
inline std::string text(Corbot::MotionState value) {
  static constexpr const char* kNames[] = {"MotionQueued", "MotionRunning", "MotionDone", "MotionStopped",
                                           "MotionFailed"};
  return kNames[value];
}

inline std::string text(CORBA::ULong value) { return fmt::format("{}", value); }
inline std::string text(Corbot::HoldingState value) {
  static constexpr const char* kNames[] = {"HoldingUnknown", "HoldingNo", "HoldingYes"};
  return kNames[value];
}
inline std::string text(Corbot::JointKind value) {
  return value == Corbot::JointSlides ? "JointSlides" : "JointTurns";
}
inline std::string text(Corbot::DeviceHealth value) {
  static constexpr const char* kNames[] = {"DeviceClosed", "DeviceOpen", "DeviceDegraded", "DeviceLost"};
  return kNames[value];
}
inline std::string text(Corbot::LimitOwner value) {
  static constexpr const char* kNames[] = {"OwnerArticulation", "OwnerTool", "OwnerToolTurn"};
  return kNames[value];
}
inline std::string text(Corbot::LimitKind value) {
  static constexpr const char* kNames[] = {"LimitSpeed", "LimitAcceleration", "LimitJerk"};
  return kNames[value];
}

// Declared before the templates that look them up.
inline std::string text(const Corbot::Point& p);
inline std::string text(const Corbot::JointRange& range);
inline std::string text(const Corbot::Quaternion& q);
inline std::string text(const Corbot::Pose& pose);
inline std::string text(const Corbot::MotionInfo& info);
inline std::string text(const Corbot::GripperInfo& info);
inline std::string text(const Corbot::JointInfo& joint);
inline std::string text(const Corbot::PoseSolution& solution);
inline std::string text(const Corbot::PlanStretch& stretch);
inline std::string text(const Corbot::WorkspaceShape& shape);
inline std::string text(const Corbot::PlanPart& part);
inline std::string text(const Corbot::DeviceInfo& info);
inline std::string text(const Corbot::ControlInfo& info);
template <class Sequence>
requires requires(const Sequence& s) { s.length(); }
inline std::string text(const Sequence& sequence);

template <class... Members>
std::string members(const Members&... named) {
  std::string all;
  ((all += fmt::format("{}{}={}", all.empty() ? "" : " ", named.first, text(named.second))), ...);
  return "{" + all + "}";
}

inline std::string text(const Corbot::Point& p) {
  return members(std::pair("x", p.x), std::pair("y", p.y), std::pair("z", p.z));
}
inline std::string text(const Corbot::CartesianCoord& p) {
  return members(std::pair("x", p.x), std::pair("y", p.y), std::pair("z", p.z), std::pair("a", p.a),
                 std::pair("b", p.b), std::pair("c", p.c));
}
inline std::string text(const Corbot::JointRange& range) {
  return members(std::pair("lower", range.lower), std::pair("upper", range.upper));
}
inline std::string text(const Corbot::AlarmInfo& alarm) {
  return members(std::pair("time", alarm.time), std::pair("code", alarm.code),
                 std::pair("active", bool{alarm.active}), std::pair("text", (const char*)alarm.text));
}
inline std::string text(const Corbot::MotionInfo& info) {
  return members(std::pair("id", info.id), std::pair("state", info.state),
                 std::pair("progress", info.progress), std::pair("duration", info.duration),
                 std::pair("reason", (const char*)info.reason));
}

template <class Sequence>
requires requires(const Sequence& s) { s.length(); }
inline std::string text(const Sequence& sequence) {
  std::string all;
  for (CORBA::ULong i = 0; i < sequence.length(); ++i) all += (i == 0 ? "" : " ") + text(sequence[i]);
  return "[" + all + "]";
}

inline std::string text(const Corbot::LoopInfo& info) {
  return members(std::pair("period", info.period), std::pair("since", info.since),
                 std::pair("cycles", info.cycles), std::pair("overruns", info.overruns),
                 std::pair("latencyMean", info.latencyMean), std::pair("latencyMax", info.latencyMax),
                 std::pair("workMax", info.workMax), std::pair("realTime", bool{info.realTime}),
                 std::pair("counts", info.counts), std::pair("edges", info.edges));
}

inline std::string text(const Corbot::DeviceInfo& info) {
  return members(std::pair("backend", (const char*)info.backend), std::pair("health", info.health),
                 std::pair("cause", info.cause), std::pair("causeText", (const char*)info.causeText),
                 std::pair("frames", info.frames), std::pair("age", info.age),
                 std::pair("ageMax", info.ageMax), std::pair("measured", bool{info.measured}),
                 std::pair("measuredAge", info.measuredAge),
                 std::pair("positionUncertain", bool{info.positionUncertain}),
                 std::pair("emergencyStop", bool{info.emergencyStop}));
}

inline std::string text(const Corbot::ServantInfo& info) {
  return members(std::pair("version", (const char*)info.version),
                 std::pair("profile", (const char*)info.profile), std::pair("started", info.started));
}

inline std::string text(const Corbot::ControlInfo& info) {
  return members(std::pair("holder", (const char*)info.holder), std::pair("left", info.left),
                 std::pair("held", bool{info.held}));
}

inline std::string text(const Corbot::GripperInfo& info) {
  return members(std::pair("commanded", info.commanded), std::pair("measured", bool{info.measured}),
                 std::pair("opening", info.opening), std::pair("holding", info.holding));
}

inline std::string text(const Corbot::Quaternion& q) {
  return members(std::pair("w", q.w), std::pair("x", q.x), std::pair("y", q.y), std::pair("z", q.z));
}

inline std::string text(const Corbot::ToolOrientationInfo& info) {
  return members(std::pair("set", bool{info.set}), std::pair("orientation", info.orientation));
}

inline std::string text(const Corbot::Pose& pose) {
  return members(std::pair("position", pose.position), std::pair("orientation", pose.orientation));
}

inline std::string text(const Corbot::JointInfo& joint) {
  return members(std::pair("name", (const char*)joint.name), std::pair("kind", joint.kind),
                 std::pair("range", joint.range), std::pair("speed", joint.speed));
}

inline std::string text(const Corbot::PoseSolution& solution) {
  return members(std::pair("number", solution.number), std::pair("joints", solution.joints),
                 std::pair("withinLimits", bool{solution.withinLimits}),
                 std::pair("orientationError", solution.orientationError));
}

inline std::string text(const Corbot::PlanStretch& stretch) {
  return members(std::pair("begin", stretch.begin), std::pair("end", stretch.end),
                 std::pair("owner", stretch.owner), std::pair("articulation", stretch.articulation),
                 std::pair("limit", stretch.limit), std::pair("share", stretch.share));
}

inline std::string text(const Corbot::PlanPart& part) {
  return members(std::pair("duration", part.duration), std::pair("stretches", part.stretches),
                 std::pair("hasPivot", bool{part.hasPivot}), std::pair("leastPivot", part.leastPivot),
                 std::pair("pivotPoint", part.pivotPoint));
}

inline std::string text(const Corbot::PlanInfo& plan) {
  return members(std::pair("start", plan.start), std::pair("end", plan.end), std::pair("parts", plan.parts));
}

inline std::string text(Corbot::ShapeKind value) {
  static constexpr const char* kNames[] = {"ShapePlane", "ShapeInside", "ShapeOutside"};
  return kNames[value];
}
inline std::string text(const Corbot::WorkspaceShape& shape) {
  return members(std::pair("name", (const char*)shape.name), std::pair("kind", shape.kind),
                 std::pair("parts", shape.parts), std::pair("normal", shape.normal),
                 std::pair("offset", shape.offset), std::pair("least", shape.least),
                 std::pair("greatest", shape.greatest));
}
inline std::string text(const Corbot::WorkspaceInfo& info) {
  return members(std::pair("profile", info.profile), std::pair("further", info.further),
                 std::pair("known", bool{info.known}));
}

inline std::string text(const Corbot::ArmState& state) {
  return members(std::pair("cycle", state.cycle), std::pair("time", state.time), std::pair("age", state.age),
                 std::pair("status", state.status), std::pair("paused", bool{state.paused}),
                 std::pair("overridePercent", state.overridePercent), std::pair("commanded", state.commanded),
                 std::pair("speeds", state.speeds), std::pair("measured", bool{state.measured}),
                 std::pair("measuredJoints", state.measuredJoints), std::pair("tool", state.tool),
                 std::pair("toolCommanded", state.toolCommanded), std::pair("motion", state.motion),
                 std::pair("queued", state.queued), std::pair("gripper", state.gripper),
                 std::pair("device", state.device), std::pair("control", state.control));
}
