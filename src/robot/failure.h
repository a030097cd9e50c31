// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "planner.h"
#include "robot/corbot_robot.h"

namespace corbot {

/// A refused call, inside this library; the C API turns it into a status and a filled corbot_error.
struct Failure {
  corbot_error error{};
};

[[nodiscard]] Failure bad_parameter_failure(const std::string& parameter, double value,
                                            const std::string& text);
[[nodiscard]] Failure not_ready(const std::string& text);
[[nodiscard]] Failure stopped(const std::string& text);
[[nodiscard]] Failure queue_full(int capacity);
[[nodiscard]] Failure no_data(const std::string& text);
[[nodiscard]] Failure internal(const std::string& text);
/// The planner's refusal at the CORBA face: radians become degrees.
[[nodiscard]] Failure refused(const PlanRefusal& refusal);

/// Copies as much as fits, as printable ASCII (the ORBs' native code set), terminated.
void copy_text(const std::string& from, char* to, std::size_t size);

}  // namespace corbot
