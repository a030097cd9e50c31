// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

namespace corbot::cli {

/// Removes the socket that a killed real-time task has left. True when it did; false when there is none, a task
/// listens on it, or it belongs to another user. The shared memory goes with the processes.
bool remove_abandoned_segment(const std::string& name) noexcept;

/// The robots whose socket that would remove.
[[nodiscard]] std::vector<std::string> abandoned_segments();

}  // namespace corbot::cli
