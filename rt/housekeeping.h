// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>

#include "corbot/arm/joint_units.h"
#include "rt/cycle/cycle.h"
#include "rt/inputs/safety_lines.h"
#include "shm/channel_server.h"

namespace corbot::rt {

/// Not real-time. Until `ended`, logs the cycle's alarms, the log lines of backend and safety lines, and the
/// servant's connections. `kinds`: kinds of the arm's joints.
void run_housekeeping(const ChannelServer& server, Cycle& cycle, Backend& backend, SafetyLines& safety,
                      const JointKinds& kinds, const std::atomic<bool>& ended);

/// Not real-time. Until `ended`, reports to the supervisor of this process as long as the cycle number
/// advances. It needs a thread of its own, since a disk that has the log may block the log's writer.
void report_progress(const Cycle& cycle, const std::atomic<bool>& ended);

/// Not real-time. Prints the log lines since the last call.
void print_log(Backend& backend);
void print_log(SafetyLines& safety);

}  // namespace corbot::rt
