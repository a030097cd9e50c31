// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>

#include "corbot/arm/workspace_limits.h"
#include "corbot/kinematics/pose.h"
#include "state/setting_store.h"

namespace corbot {

/// The planes and boxes that clients set, and the base frame for which they hold.
struct PlacedShapes {
  FurtherShapes further;
  Pose world_T_base;
};

/// Placed shapes as TOML. Every number is read as it was written, to the last bit: the number_of() the shapes
/// stays the same over a restart.
struct FurtherShapesText {
  using Value = PlacedShapes;
  static constexpr const char* kSuffix = ".workspace";
  static constexpr std::size_t kMostBytes = 8192;

  [[nodiscard]] static std::string write(const PlacedShapes& placed, const SettingOwner& owner,
                                         const ArmModel& arm);
  /// Reads the output of write() without trusting any byte. Throws SettingError unless the shapes are of this
  /// owner and this model of its arm. They must also have names and parts, and be sound.
  [[nodiscard]] static PlacedShapes read(std::string_view text, const SettingOwner& owner,
                                         const ArmModel& arm);
};
using FurtherShapesStore = SettingStore<FurtherShapesText>;

}  // namespace corbot
