// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace corbot::cell {

/// Counts the ORB's calls on each connection of net/connections.h: a connection with a call is not idle. Call
/// it after ORB_init.
void count_calls();

}  // namespace corbot::cell
