// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>

#include "config/arms/description.h"

namespace corbot::config {

/// The family of a D-H table that no family takes, read in the other convention: `as "standard" it is of the family 'SCARA'`.
/// Empty where a family takes the table as it is, or takes neither reading.
[[nodiscard]] std::string other_reading(const DhTable& table, const Joints& home_q);

/// The angle, in degrees, that this many "degrees" are in radians. Only multiples of 45 degrees are looked for, by
/// three digits or more: 1.571, not 1.57. Empty for anything else.
[[nodiscard]] std::optional<double> degrees_if_radians(double angle_rad);

/// The first rotation of a URDF that no radians can be: `0 90 0`. Empty: there is none.
[[nodiscard]] std::string rotation_in_degrees(const std::string& urdf);

}  // namespace corbot::config
