// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>

#include "config/arms/description.h"

namespace corbot::config {

/// Reads a D-H table that no family accepts in the other convention. Returns text such as `as "standard" it
/// is of the family 'SCARA'`. Returns "" if a family accepts the table as it is, or accepts neither reading.
[[nodiscard]] std::string other_reading(const DhTable& table, const Joints& home_q);

/// Returns the angle, in degrees, whose value in radians equals this many "degrees". It recognises only
/// multiples of 45 degrees, with three digits or more: 1.571, not 1.57. Returns nothing otherwise.
[[nodiscard]] std::optional<double> degrees_if_radians(double angle_rad);

/// Returns the first rotation of a URDF that cannot be in radians, such as `0 90 0`, or "".
[[nodiscard]] std::string rotation_in_degrees(const std::string& urdf);

}  // namespace corbot::config
