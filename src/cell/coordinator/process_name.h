// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

namespace corbot::cell {

/// Returns this process's name for a claim and for control: "PROGRAM@HOST/BOOT/PID/START", 1 to 57 printable
/// characters. The name stays unique after a reboot or a reused PID. Throws client::Failure if /proc is
/// unreadable.
[[nodiscard]] std::string process_name();
/// Tells if the named process of any program ran on this machine since its last boot and has ended. Ignores
/// the mark of waiting_name(). Throws as process_name() does.
[[nodiscard]] bool is_of_dead_process(const std::string& name);

/// Returns the name with a mark: the claim's holder waits for a person.
[[nodiscard]] std::string waiting_name(const std::string& name);
[[nodiscard]] bool is_waiting_name(const std::string& name);

}  // namespace corbot::cell
