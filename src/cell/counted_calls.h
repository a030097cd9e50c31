// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace corbot::cell {

/// Notes on each connection of net/connections.h the calls that the ORB carries out: a connection with a call is not idle. Call
/// this after ORB_init.
void count_calls();

}  // namespace corbot::cell
