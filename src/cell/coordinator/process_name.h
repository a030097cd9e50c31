// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

namespace corbot::cell {

/// This process, for a claim and for control: "corbot-coordinator@HOST/BOOT/PID/START", 1 to 64 printable
/// characters. No other process has the name, also after a restart of the machine or a PID that comes again.
/// Throws client::Failure where /proc does not say it.
[[nodiscard]] std::string process_name();

}  // namespace corbot::cell
