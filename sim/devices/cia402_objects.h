// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include "sim/devices/can_objects.h"

namespace corbot::sim {

/// Adds the dictionary of an emulated drive, as from the factory.
void add_drive_objects(CanObjects& objects, std::uint8_t node);
/// Adds its communication objects, 1000h to 1FFFh.
void add_communication_objects(CanObjects& objects, std::uint8_t node);

}  // namespace corbot::sim
