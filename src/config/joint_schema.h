// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <map>
#include <string>

#include "config/geometry_schema.h"
#include "config/section.h"

namespace corbot {

/// The channels in use, each with its key, so that a fault can name both.
using ChannelUse = std::map<std::uint32_t, std::string>;

/// Reads a name at `key`; returns "" after a fault.
[[nodiscard]] std::string read_name(Section& section, std::string_view key);

/// Reads every `[[joint]]`. `needs_servos`: the backend sends pulses.
void read_joints(Section& root, Profile& profile, GeometryInput& geometry, bool needs_servos,
                 ChannelUse& in_use);

/// Reads `[gripper]`. `needs_servos`: the backend sends pulses.
void read_gripper(Section section, Profile& profile, bool needs_servos, ChannelUse& in_use);

/// Gives a servo to every joint, and to the gripper, that has none. Its 500 to 2500 us cover the joint's
/// range, or as much of it that its speed is at most 4/5 of the simulated servos'. To be called after
/// `[backend]`.
void fit_servos(Profile& profile, ChannelUse& in_use);

}  // namespace corbot
