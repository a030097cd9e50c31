// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

namespace corbot::cli {

/// Removes the shared memory of a robot when neither a real-time task nor a servant holds it any more. True
/// when it did; false when there is none, it is in use, or it belongs to another user.
bool remove_abandoned_segment(const std::string& name) noexcept;

/// The robots whose shared memory that would remove.
[[nodiscard]] std::vector<std::string> abandoned_segments();

}  // namespace corbot::cli
