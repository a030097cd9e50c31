// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <nlohmann/json_fwd.hpp>

#include "client/program.h"

namespace corbot::panel {

/// Limits the body of POST /api/program, so that its check delays no other request by much.
inline constexpr std::size_t kMostProgramBodyBytes = 65'536;

/// Returns the program in the body of POST /api/program: {"robot": NAME, "name": FILE, "text": PROGRAM}. It
/// does not check the robot's name. Throws client::Failure, kUsage: the body has another form, or the program
/// has faults, whose lines the text names.
[[nodiscard]] client::Program program_request(const nlohmann::json& body);

}  // namespace corbot::panel
