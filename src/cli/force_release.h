// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "client/client.h"

namespace corbot::cli {

/// Ends any holder's control of this user's robot on this machine without a key: the arm stops on its path.
/// Returns the name of the holder. Throws Failure if no client has control, or if control continues after
/// `timeout_s`.
std::string release_by_force(client::Client& client, const std::string& robot, double timeout_s);

}  // namespace corbot::cli
