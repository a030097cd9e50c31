// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <type_traits>

#include "corbot/arm/joints.h"
#include "corbot/channel/durable_cell.h"

// What a servant knows that its successor must know, too. It is written as it changes, since a servant may be
// killed at any time, and read by the next servant, which checks every field (src/robot/inherited_state.h): the
// one that wrote it may have been broken, or hostile. Every record is plain, fixed-size and a multiple of eight
// bytes without padding.

namespace corbot {

/// What Speed, AllSpeed, ArtSpeed and the tool pitch have set.
struct SettingsRecord {
  double speed_ratio;        ///< (0, 1]
  Joints joint_speed_ratio;  ///< likewise
  double tool_pitch_rad;     ///< -pi ... pi
};
static_assert(std::is_trivially_copyable_v<SettingsRecord> && sizeof(SettingsRecord) % 8 == 0);

/// In the servant's segment. A record that belongs to it is added here, with its reader.
struct ServantState {
  DurableCell<SettingsRecord> settings;
};
static_assert(std::is_standard_layout_v<ServantState>);

}  // namespace corbot
