// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>

#include "rt/cycle/cycle.h"
#include "rt/inputs/safety_lines.h"
#include "shm/segment.h"

namespace corbot::rt {

/// Not real-time. Until `ended`: prints the cycle's alarms, and tells when the servant comes and goes. The
/// watchdog needs to do no more: every command ends at rest, so an arm without a servant finishes what was
/// accepted and holds.
void keep_house(const Segment& segment, Cycle& cycle, Backend& backend, SafetyLines& safety,
                const std::atomic<bool>& ended);

/// Not real-time. Print what they have to tell since the last time.
void print_news(Backend& backend);
void print_news(SafetyLines& safety);

}  // namespace corbot::rt
