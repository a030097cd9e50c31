// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>

#include "corbot/kinematics/arm_kinematics.h"
#include "planner/plan/plan.h"
#include "planner/request.h"
#include "robot/corbot_robot.h"

namespace corbot {

/// A refused call, inside this library; the C API turns it into a status and a filled corbot_error.
struct CallError {
  corbot_error error{};
};

[[nodiscard]] CallError bad_argument(const std::string& parameter, double value, const std::string& text);
/// The ratio; throws bad_argument unless it is above 0 and at most 100.
[[nodiscard]] double checked_percent(const std::string& parameter, double percent);
/// A ticket that was never given away, or is forgotten.
[[nodiscard]] CallError no_such_motion(std::uint64_t id);
[[nodiscard]] CallError not_ready(const std::string& text);
[[nodiscard]] CallError stopped(const std::string& text);
[[nodiscard]] CallError queue_full(int capacity);
/// The same, of calls of a host that are blocked.
[[nodiscard]] CallError calls_full(int capacity);
[[nodiscard]] CallError no_data(const std::string& text);
[[nodiscard]] CallError internal(const std::string& text);
/// The planner's refusal at the CORBA interface: radians become degrees, but of joints that slide.
[[nodiscard]] CallError refused(const PlanRefusal& refusal, const Kinematics& arm);
/// The same of a motion: of Ready, which raises no other, NotReady.
[[nodiscard]] CallError refused(const MotionRequest& request, const PlanRefusal& refusal,
                                const Kinematics& arm);

/// Radians as degrees of the CORBA interface, without the last bits that the way there and back leaves: -30,
/// not -29.999999999999996. For limits and refusals, never for joint positions.
[[nodiscard]] double tidy_degrees(double angle_rad);
/// The same of a joint's value, in metres where it slides.
[[nodiscard]] double tidy_shown(JointKind kind, double value_q);

/// In ASCII, the ORBs' native code set.
[[nodiscard]] constexpr bool is_printable(char c) noexcept { return c >= ' ' && c <= '~'; }
/// Copies as much as fits, as printable ASCII, terminated.
void copy_text(const std::string& from, char* to, std::size_t size);

}  // namespace corbot
