// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "client/client.h"

namespace corbot::cli {

/// Ends whoever's control of a robot of this user on this machine, of which no key is needed: the arm is stopped on its path.
/// Returns the name of who had it. Throws Failure where nobody has control, or it goes on after `timeout_s`.
std::string release_by_force(client::Client& client, const std::string& robot, double timeout_s);

}  // namespace corbot::cli
