// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "client/client.h"

namespace corbot::cli {

/// Returns "X Y Z m, orientation QW QX QY QZ".
[[nodiscard]] std::string frame_text(const Corbot::Pose& frame);
/// Returns the text of `corbot frames`: tool and base frame in force.
[[nodiscard]] std::string read_frames(client::Client& client);
/// Returns the text of `corbot workspace`: the profile's planes and boxes, and those that clients have set.
[[nodiscard]] std::string read_workspace(client::Client& client);
/// Returns the text of `corbot solutions`. `pose`: X Y Z, or X Y Z QW QX QY QZ; three numbers use the tool's
/// present orientation.
[[nodiscard]] std::string read_solutions(client::Client& client, const std::vector<double>& pose,
                                         bool as_json);

}  // namespace corbot::cli
