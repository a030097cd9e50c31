// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

namespace corbot::cell {

/// This process, for a claim and for control: "PROGRAM@HOST/BOOT/PID/START", 1 to 57 printable characters. No other process has the name, also after a restart of the machine or a PID that comes again.
/// Throws client::Failure where /proc does not say it.
[[nodiscard]] std::string process_name();
/// Whether that process, of any program, was one of this machine, since its last start, and has ended. The mark of a waiting name is left
/// out. Throws as process_name does.
[[nodiscard]] bool is_of_dead_process(const std::string& name);

/// The name with the mark of a claim whose holder waits for a person.
[[nodiscard]] std::string waiting_name(const std::string& name);
[[nodiscard]] bool is_waiting_name(const std::string& name);

}  // namespace corbot::cell
