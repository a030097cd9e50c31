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

/// A name at `key`, empty after a fault.
[[nodiscard]] std::string read_name(Section& section, std::string_view key);

/// Every `[[joint]]`. `needs_servos`: the backend sends pulses.
void read_joints(Section& root, Profile& profile, GeometryInput& geometry, bool needs_servos,
                 ChannelUse& in_use);

/// `[gripper]`; likewise.
void read_gripper(Section section, Profile& profile, bool needs_servos, ChannelUse& in_use);

/// Whether a backend of this kind sends pulses, so that every joint must say what a pulse means. The others take set-points of
/// joints: drives by their own scale, the simulator by servos that are made to measure.
[[nodiscard]] bool sends_pulses(std::string_view backend_kind);

/// A servo for every joint, and for the gripper, that has none: its 500 to 2500 us are the joint's range, or as much of them that its
/// speed is at most 4/5 of the simulated servos'. After `[backend]`.
void fit_servos(Profile& profile, ChannelUse& in_use);

}  // namespace corbot
