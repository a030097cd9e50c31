// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <fmt/format.h>

#include <cstdint>
#include <string>
#include <type_traits>
#include <utility>

#include "robot/caller.h"
#include "robot/robot_handle.h"

// Carry out the functions of corbot_robot.h that have a caller, with control and the audit log. For the
// sources of that header only. No exception leaves these functions.

namespace corbot {

/// Returns the outcome with the interface's name of the exception.
inline std::string outcome_of(const corbot_error& error) {
  switch (error.status) {
    case CORBOT_OK:
      return "ok";
    case CORBOT_BAD_PARAMETER:
      return fmt::format("BadParameter: {}: {}", error.parameter, error.text);
    case CORBOT_UNREACHABLE:
      return fmt::format("Unreachable: {}", error.text);
    case CORBOT_LIMIT_EXCEEDED:
      return fmt::format("LimitExceeded: {}", error.text);
    case CORBOT_NOT_READY:
      return fmt::format("NotReady: {}", error.text);
    case CORBOT_STOPPED:
      return fmt::format("Stopped: {}", error.text);
    case CORBOT_QUEUE_FULL:
      return fmt::format("QueueFull: {}", error.text);
    case CORBOT_NO_DATA:
    case CORBOT_INTERNAL:
      break;
  }
  return error.text;
}

/// Runs `body`, which may take the caller's key and return a ticket. Then records the call, i.e. `text` with
/// the arguments, and its outcome. Without memory the call matters more than its entry: a failure in work for
/// the entry alone does not fail the call.
template <class Body, class... Arguments>
corbot_status recorded(corbot_robot* robot, const corbot_caller* caller, corbot_error* error, Body&& body,
                       fmt::format_string<const Arguments&...> text, const Arguments&... arguments) noexcept {
  corbot_error ignored{};
  corbot_error& out = error != nullptr ? *error : ignored;
  const auto carry_out = [&] {
    if constexpr (std::is_invocable_v<Body&>) {
      return body();
    } else {
      return body(key_of(caller));
    }
  };
  std::string who;  // read before the call, which may end control
  std::uint64_t ticket = 0;
  guarded(nullptr, [&] { who = robot->robot.control().name_of(key_of(caller)); });
  const corbot_status status = guarded(&out, [&] {
    if constexpr (std::is_void_v<decltype(carry_out())>) {
      carry_out();
    } else {
      ticket = carry_out();
    }
  });
  guarded(nullptr, [&] {
    // Stops and Clear need no key, and a client with control does not flood the log.
    const bool is_refusal = status != CORBOT_OK && who.empty() && !std::is_invocable_v<Body&>;
    robot->robot.record(
        {who, from_of(caller), fmt::format(text, arguments...), ticket, outcome_of(out), is_refusal});
  });
  return status;
}

[[nodiscard]] corbot_plan shown(const MotionPlan& plan, const Kinematics& arm);

/// Starts a motion, or only plans it if the caller requests a plan. `make` makes the checks of the C
/// interface and returns the request.
template <class Make, class... Arguments>
corbot_status start(corbot_robot* robot, const corbot_caller* caller, corbot_ticket* ticket,
                    corbot_error* error, Make&& make, fmt::format_string<const Arguments&...> text,
                    const Arguments&... arguments) noexcept {
  if (caller != nullptr && caller->plan != nullptr) {
    return guarded(error, [&] {  // a read, which is not recorded
      *caller->plan = shown(robot->robot.plan(make()), robot->robot.profile().arm.kinematics);
    });
  }
  return recorded(
      robot, caller, error,
      [&](const std::string& key) {
        return *ticket = robot->robot.accept(make(), caller != nullptr ? caller->stops : 0, key,
                                             wanted_to_start(caller));
      },
      text, arguments...);
}

/// Changes how the arm moves; needs control. `how` gets the abort check.
template <class Change, class... Arguments>
corbot_status change(corbot_robot* robot, const corbot_caller* caller, corbot_error* error, Change&& how,
                     fmt::format_string<const Arguments&...> text, const Arguments&... arguments) noexcept {
  return recorded(
      robot, caller, error,
      [&](const std::string& key) {
        const Control::Use use = robot->robot.control().use(key);
        how(robot->robot, wanted_to_change(caller));
      },
      text, arguments...);
}

}  // namespace corbot
