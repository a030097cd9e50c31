// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>

#include "corbot/arm/joint_units.h"
#include "rt/cycle/cycle.h"
#include "rt/inputs/safety_lines.h"
#include "shm/channel_server.h"

namespace corbot::rt {

/// Not real-time. Until `ended`: logs the cycle's alarms, what backend and safety lines have to log, and
/// when the servant comes and goes. `kinds`: of the arm's joints.
void run_housekeeping(const ChannelServer& server, Cycle& cycle, Backend& backend, SafetyLines& safety,
                      const JointKinds& kinds, const std::atomic<bool>& ended);

/// Not real-time. Until `ended`: reports to the supervisor of this process for as long as the cycle number advances. A
/// thread of its own, since the log may be held up by whoever reads it.
void report_progress(const Cycle& cycle, const std::atomic<bool>& ended);

/// Not real-time. Logs what they have had to log since the last time.
void print_log(Backend& backend);
void print_log(SafetyLines& safety);

}  // namespace corbot::rt
