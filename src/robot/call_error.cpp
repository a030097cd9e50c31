// SPDX-License-Identifier: Apache-2.0
#include "robot/call_error.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <variant>

#include "corbot/arm/joint_units.h"

namespace corbot {
namespace {

CallError call_error(corbot_status status, const std::string& text) {
  CallError result;
  result.error.status = status;
  result.error.joint = -1;
  copy_text(text, result.error.text, sizeof(result.error.text));
  return result;
}

CallError full(int capacity, const std::string& text) {
  CallError result = call_error(CORBOT_QUEUE_FULL, text);
  result.error.capacity = capacity;
  return result;
}

/// Converts the planner's radians to the interface's degrees. `kind`: kind of the joint that the refusal is
/// about.
double shown(Quantity quantity, JointKind kind, double value) {
  switch (quantity) {
    case Quantity::kAngle:
      return tidy_degrees(value);
    case Quantity::kJointValue:
    case Quantity::kJointSpeed:
      return tidy_shown(kind, value);
    case Quantity::kNumber:
    case Quantity::kLength:
    case Quantity::kTime:
      break;
  }
  return value;
}

}  // namespace

double tidy_degrees(double angle_rad) {
  constexpr double kSteps = 1e9;        // steps per degree
  constexpr double kWorthIt_deg = 1e6;  // a double above this has no digits to drop
  const double angle_deg = to_degrees(angle_rad);
  return std::abs(angle_deg) <= kWorthIt_deg ? std::round(angle_deg * kSteps) / kSteps : angle_deg;
}

double tidy_shown(JointKind kind, double value_q) {
  return kind == JointKind::kRotary ? tidy_degrees(value_q) : value_q;
}

void copy_text(const std::string& from, char* to, std::size_t size) {
  const std::size_t length = std::min(from.size(), size - 1);
  std::transform(from.begin(), from.begin() + static_cast<std::ptrdiff_t>(length), to,
                 [](char c) { return is_printable(c) ? c : '?'; });
  to[length] = '\0';
}

CallError bad_argument(const std::string& parameter, double value, const std::string& text) {
  CallError result = call_error(CORBOT_BAD_PARAMETER, text);
  copy_text(parameter, result.error.parameter, sizeof(result.error.parameter));
  result.error.value = value;
  return result;
}

double checked_percent(const std::string& parameter, double percent) {
  if (percent > 0.0 && percent <= 100.0) return percent / 100.0;
  throw bad_argument(parameter, percent, fmt::format("{:.6g} percent, allowed above 0 up to 100", percent));
}

CallError no_such_motion(std::uint64_t id) {
  return bad_argument(
      "id", static_cast<double>(id),
      fmt::format("motion {} is unknown: no motion had this number, or its record was dropped", id));
}

CallError not_ready(const std::string& text) { return call_error(CORBOT_NOT_READY, text); }
CallError stopped(const std::string& text) { return call_error(CORBOT_STOPPED, text); }
CallError no_data(const std::string& text) { return call_error(CORBOT_NO_DATA, text); }
CallError internal(const std::string& text) { return call_error(CORBOT_INTERNAL, text); }

CallError queue_full(int capacity) {
  return full(capacity, fmt::format("{} motions are running or queued already", capacity));
}

CallError calls_full(int capacity) {
  return full(capacity, fmt::format("{0} other calls of this host are blocked, {0} are allowed", capacity));
}

CallError refused(const PlanRefusal& refusal, const Kinematics& arm) {
  static constexpr corbot_status kStatus[] = {CORBOT_BAD_PARAMETER, CORBOT_UNREACHABLE,
                                              CORBOT_LIMIT_EXCEEDED};
  CallError result = call_error(kStatus[static_cast<std::size_t>(refusal.kind)], refusal.text);
  // A refusal for a joint that the arm does not have names this joint, too.
  const auto joint = static_cast<std::size_t>(refusal.joint);
  const bool has_joint = refusal.joint >= 0 && joint < arm.joint_count();
  const JointKind kind = has_joint ? arm.joint_kind(joint) : JointKind::kRotary;
  copy_text(refusal.parameter, result.error.parameter, sizeof(result.error.parameter));
  result.error.joint = refusal.joint;
  result.error.value = shown(refusal.quantity, kind, refusal.value);
  result.error.lower = shown(refusal.quantity, kind, refusal.lower);
  result.error.upper = shown(refusal.quantity, kind, refusal.upper);
  std::copy(refusal.target_m.begin(), refusal.target_m.end(), result.error.target_m);
  return result;
}

CallError refused(const MotionRequest& request, const PlanRefusal& refusal, const Kinematics& arm) {
  if (std::holds_alternative<ReadyRequest>(request))
    return not_ready(fmt::format("the initial position: {}", refusal.text));
  return refused(refusal, arm);
}

}  // namespace corbot
