// SPDX-License-Identifier: Apache-2.0
#include "motion/watcher.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "corbot/motion/bounds.h"
#include "corbot/motion/path.h"

namespace corbot::test {
namespace {

constexpr double kPlanTolerance = 1e-6;
constexpr double kRampTolerance = 1e-5;
constexpr double kSpeedRounding = 1e-9;
constexpr double kAccelerationRounding = 1e-7;
constexpr double kJerkRounding = 1e-4;
constexpr double kTurnRounding = 1e-7;

using TickPoint = std::array<double, 3>;

TickPoint minus(const TickPoint& a, const TickPoint& b) { return {a[0] - b[0], a[1] - b[1], a[2] - b[2]}; }
double norm(const TickPoint& a) { return std::hypot(a[0], a[1], a[2]); }
double dot(const TickPoint& a, const TickPoint& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

double deviation_from(const LineMotion& line, const TickPoint& p) {
  const TickPoint way = minus(line.to_m, line.from_m);
  const double square = dot(way, way);
  const TickPoint from = minus(p, line.from_m);
  const double s = square > 0.0 ? std::clamp(dot(from, way) / square, 0.0, 1.0) : 0.0;
  return norm({from[0] - s * way[0], from[1] - s * way[1], from[2] - s * way[2]});
}

double deviation_from(const ArcMotion& arc, const TickPoint& p) {
  const TickPoint r = minus(p, arc.centre_m);
  const double x = dot(r, arc.u);
  const double y = dot(r, arc.v);
  const double off_plane = norm({r[0] - x * arc.u[0] - y * arc.v[0], r[1] - x * arc.u[1] - y * arc.v[1],
                                 r[2] - x * arc.u[2] - y * arc.v[2]});
  return std::hypot(off_plane, std::hypot(x, y) - arc.radius_m);
}

}  // namespace

Watcher::Watcher(const ArmModel& arm, const Snapshot& at_rest)
    : arm_(arm), dt_s_(static_cast<double>(arm.period_ns) * 1e-9) {
  q_.fill(at_rest.position_q);
  const Pose pose = arm.kinematics.forward(at_rest.position_q);
  p_.fill(pose.position_m);
  orientation_.fill(pose.orientation);
}

void Watcher::begin(const Command& command) {
  command_ = command;
  has_command_ = true;
  ramped_ = false;
  last_rate_ = -1.0;
  path_age_ = 0;
}

bool Watcher::fail(const std::string& what, double value, double bound) {
  error = fmt::format("{}: {} beyond {}", what, value, bound);
  return false;
}

bool Watcher::see(const Snapshot& snapshot) {
  std::rotate(q_.rbegin(), q_.rbegin() + 1, q_.rend());
  std::rotate(p_.rbegin(), p_.rbegin() + 1, p_.rend());
  q_[0] = snapshot.position_q;
  const Pose pose = arm_.kinematics.forward(snapshot.position_q);
  p_[0] = pose.position_m;
  orientation_ = {pose.orientation, orientation_[0]};
  turn_ = {angle_between(orientation_[0], orientation_[1]), turn_[0], turn_[1]};
  if (snapshot.command_id != 0) {
    ramped_ = ramped_ || (last_rate_ >= 0.0 && snapshot.virtual_rate != last_rate_);
    last_rate_ = snapshot.virtual_rate;
  }
  if (snapshot.state == RtState::kError && !expects_fault_) return fail("fault", 0, 0);
  if (!see_range(snapshot)) return false;
  for (std::size_t i = 0; i < arm_.dof; ++i) {
    if (!see_joint(i)) return false;
  }
  const bool on_path =
      has_command_ && (command_.kind == MotionKind::kLine || command_.kind == MotionKind::kArc);
  return !on_path || (see_path() && see_turn() && see_deviation(snapshot));
}

bool Watcher::see_range(const Snapshot& snapshot) {
  for (std::size_t i = 0; i < arm_.dof; ++i) {
    const double q = snapshot.position_q[i];
    const JointLimits& limits = arm_.joints[i];
    if (!(q >= limits.lower_q - kRangeTolerance_q)) return fail("lower end of range", q, limits.lower_q);
    if (!(q <= limits.upper_q + kRangeTolerance_q)) return fail("upper end of range", q, limits.upper_q);
  }
  return true;
}

bool Watcher::see_joint(std::size_t i) {
  const JointLimits& limits = arm_.joints[i];
  const double speed = std::abs(q_[0][i] - q_[1][i]) / dt_s_;
  const double tolerance = ramped_ ? kRampTolerance : kPlanTolerance;
  joint.speed = std::max(joint.speed, speed / limits.speed_q_s);
  if (!(speed <= limits.speed_q_s * (1 + tolerance) + kSpeedRounding + 1e-6)) {
    return fail(fmt::format("joint {} speed", i), speed, limits.speed_q_s);
  }
  if (!has_command_ || (command_.kind != MotionKind::kJoint && knots_of(command_) == nullptr)) return true;
  const double acceleration = std::abs(q_[0][i] - 2 * q_[1][i] + q_[2][i]) / (dt_s_ * dt_s_);
  const double jerk = std::abs(q_[0][i] - 3 * q_[1][i] + 3 * q_[2][i] - q_[3][i]) / (dt_s_ * dt_s_ * dt_s_);
  joint.acceleration = std::max(joint.acceleration, acceleration / limits.acceleration_q_s2);
  joint.jerk = std::max(joint.jerk, jerk / limits.jerk_q_s3);
  if (!(acceleration <= limits.acceleration_q_s2 * (1 + tolerance) + kAccelerationRounding)) {
    return fail(fmt::format("joint {} acceleration", i), acceleration, limits.acceleration_q_s2);
  }
  if (!(jerk <= limits.jerk_q_s3 * (1 + tolerance) + kJerkRounding)) {
    return fail(fmt::format("joint {} jerk", i), jerk, limits.jerk_q_s3);
  }
  return true;
}

/// The TCP's own limits. Set-points before the path began belong to another motion: the third difference
/// waits for them to have left, except for the resting one right before.
bool Watcher::see_path() {
  ++path_age_;
  const PathLimits& limits = arm_.path;
  const double tolerance = ramped_ ? kRampTolerance : kPlanTolerance;
  const double speed = norm(minus(p_[0], p_[1])) / dt_s_;
  TickPoint second{};
  TickPoint third{};
  for (std::size_t i = 0; i < 3; ++i) {
    second[i] = p_[0][i] - 2 * p_[1][i] + p_[2][i];
    third[i] = p_[0][i] - 3 * p_[1][i] + 3 * p_[2][i] - p_[3][i];
  }
  const double acceleration = path_age_ >= 2 ? norm(second) / (dt_s_ * dt_s_) : 0.0;
  const double jerk = path_age_ >= 3 ? norm(third) / (dt_s_ * dt_s_ * dt_s_) : 0.0;
  path.speed = std::max(path.speed, speed / limits.speed_m_s);
  path.acceleration = std::max(path.acceleration, acceleration / limits.acceleration_m_s2);
  path.jerk = std::max(path.jerk, jerk / limits.jerk_m_s3);
  if (!(speed <= limits.speed_m_s * (1 + kPlanTolerance) + kSpeedRounding)) {
    return fail("path speed", speed, limits.speed_m_s);
  }
  if (!(acceleration <= limits.acceleration_m_s2 * (1 + tolerance) + kAccelerationRounding)) {
    return fail("path acceleration", acceleration, limits.acceleration_m_s2);
  }
  if (!(jerk <= limits.jerk_m_s3 * (1 + tolerance) + kJerkRounding))
    return fail("path jerk", jerk, limits.jerk_m_s3);
  return true;
}

/// Checks the turn of arms that follow an orientation; the heading of other arms goes with their joints. The
/// tool turns about one axis, and does not turn back: the differences of its angles are those of its
/// rotation.
bool Watcher::see_turn() {
  if (arm_.kinematics.follows() != Follows::kFull) return true;
  const PathLimits& limits = arm_.path;
  const double tolerance = ramped_ ? kRampTolerance : kPlanTolerance;
  const double speed = turn_[0] / dt_s_;
  const double acceleration = path_age_ >= 2 ? std::abs(turn_[0] - turn_[1]) / (dt_s_ * dt_s_) : 0.0;
  const double jerk =
      path_age_ >= 3 ? std::abs(turn_[0] - 2 * turn_[1] + turn_[2]) / (dt_s_ * dt_s_ * dt_s_) : 0.0;
  rotation.speed = std::max(rotation.speed, speed / limits.rotation_speed_rad_s);
  rotation.acceleration = std::max(rotation.acceleration, acceleration / limits.rotation_acceleration_rad_s2);
  rotation.jerk = std::max(rotation.jerk, jerk / limits.rotation_jerk_rad_s3);
  if (!(speed <= limits.rotation_speed_rad_s * (1 + kPlanTolerance) + kTurnRounding))
    return fail("rotation speed", speed, limits.rotation_speed_rad_s);
  if (!(acceleration <= limits.rotation_acceleration_rad_s2 * (1 + tolerance) + kTurnRounding))
    return fail("rotation acceleration", acceleration, limits.rotation_acceleration_rad_s2);
  return jerk <= limits.rotation_jerk_rad_s3 * (1 + tolerance) + kJerkRounding ||
         fail("rotation jerk", jerk, limits.rotation_jerk_rad_s3);
}

bool Watcher::see_deviation(const Snapshot& snapshot) {
  (void)snapshot;
  const double deviation = command_.kind == MotionKind::kLine ? deviation_from(command_.line, p_[0])
                                                              : deviation_from(command_.arc, p_[0]);
  deviation_m = std::max(deviation_m, deviation);
  return deviation < 1e-6 || fail("deviation from the path", deviation, 1e-6);
}

}  // namespace corbot::test
