// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "soak/device_log.h"
#include "soak/evidence.h"
#include "soak/verdict.h"

// The judge's checks of a run with devices: of the set-points, and of the devices' own records.

namespace corbot::soak {

/// A fault of a device, of its wires, or of a process, and what has to come of it.
struct DeviceFault : Break {
  std::vector<std::string> alarms{};  ///< codes of what may be active because of this
  double error_within_s{};  ///< lasting so long it has to be an Error by then; 0: it need not be one
  std::string name{};       ///< what has to be in the text of an alarm when a person clears; "": nothing
  bool is_heard{true};      ///< the device takes commands meanwhile
};

struct DeviceEvidence {
  const Evidence& base;
  const DeviceLog& log;
  const Track& track;
  std::vector<DeviceFault> faults{};
  double ramp_s{1.0};              ///< `[stop] ramp_s`
  std::vector<double> goal_deg{};  ///< `goal_tolerance_deg`, a joint each
};

/// Which Clear ended this time in Error: null when none did, so far as is known.
[[nodiscard]] const Clear* clear_of(const DeviceEvidence& evidence, const Episode& episode);

/// Checks the time between a fault and a person's Clear. No servo gets power, and only the ramp of the stop
/// moves the arm. Drives within reach are switched off in time. No Error ends by itself.
void check_energy(const DeviceEvidence& evidence, Verdict& verdict);
/// After a Clear nothing moves before the next motion, and the first one is slow where the position is
/// unverified.
void check_return(const DeviceEvidence& evidence, Verdict& verdict);
/// Checks that the device was there and had power for each motion that its caller got as done.
void check_success(const DeviceEvidence& evidence, Verdict& verdict);
/// Joints' and tool's limits, also while a fault stops the arm: but for those in which no ramp is possible.
void check_ramps(const DeviceEvidence& evidence, Verdict& verdict);
/// A fault that lasts is an Error in time; alarms name a cause that was there.
void check_alarms(const DeviceEvidence& evidence, Verdict& verdict);

Verdict judge_devices(const DeviceEvidence& evidence);

}  // namespace corbot::soak
