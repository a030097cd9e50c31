// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>

#include "corbot/kinematics/arm_kinematics.h"
#include "planner/plan/plan.h"
#include "planner/request.h"
#include "robot/corbot_robot.h"

namespace corbot {

/// A refused call, inside this library. The C API turns it into a status and a filled corbot_error.
struct CallError {
  corbot_error error{};
};

[[nodiscard]] CallError bad_argument(const std::string& parameter, double value, const std::string& text);
/// Returns the ratio. Throws bad_argument unless the percentage is above 0 and at most 100.
[[nodiscard]] double checked_percent(const std::string& parameter, double percent);
/// A ticket that was never issued, or that the table has dropped.
[[nodiscard]] CallError no_such_motion(std::uint64_t id);
[[nodiscard]] CallError not_ready(const std::string& text);
[[nodiscard]] CallError stopped(const std::string& text);
[[nodiscard]] CallError queue_full(int capacity);
/// Too many blocked calls of one host.
[[nodiscard]] CallError calls_full(int capacity);
[[nodiscard]] CallError no_data(const std::string& text);
[[nodiscard]] CallError internal(const std::string& text);
/// A planner's refusal in the units of the CORBA interface: radians become degrees, except those of sliding
/// joints.
[[nodiscard]] CallError refused(const PlanRefusal& refusal, const Kinematics& arm);
/// The refusal of a motion. A refused Ready becomes NotReady, as Ready raises no other exception.
[[nodiscard]] CallError refused(const MotionRequest& request, const PlanRefusal& refusal,
                                const Kinematics& arm);

/// Converts radians to degrees and drops the digits that are rounding error of the conversion there and back:
/// -30, not -29.999999999999996. For limits and refusals, never for joint positions.
[[nodiscard]] double tidy_degrees(double angle_rad);
/// Does the same for a joint's value, which is in metres if the joint slides.
[[nodiscard]] double tidy_shown(JointKind kind, double value_q);

/// Returns true for printable ASCII, the ORBs' native code set.
[[nodiscard]] constexpr bool is_printable(char c) noexcept { return c >= ' ' && c <= '~'; }
/// Copies as much as fits, as printable ASCII with a terminating zero.
void copy_text(const std::string& from, char* to, std::size_t size);

}  // namespace corbot
