// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "cli/status_report.h"
#include "client/client.h"

namespace corbot::cli {

/// Draws the arm of a robot on this machine as it stands, with its reach, into a file. Frames, soft limits,
/// planes and boxes are those in force. Throws Failure.
void draw_status(client::Client& client, const std::string& robot, const StatusReport& now,
                 const std::string& file);

}  // namespace corbot::cli
