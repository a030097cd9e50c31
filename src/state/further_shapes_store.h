// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>

#include "corbot/arm/workspace_limits.h"
#include "state/setting_store.h"

namespace corbot {

/// The planes and boxes that clients set, as TOML. Every number is read as it was written, to the last bit:
/// the number_of() the shapes stays the same over a restart.
struct FurtherShapesText {
  using Value = FurtherShapes;
  static constexpr const char* kSuffix = ".workspace";
  static constexpr std::size_t kMostBytes = 8192;

  [[nodiscard]] static std::string write(const FurtherShapes& further, const SettingOwner& owner,
                                         const ArmModel& arm);
  /// Reads the output of write() without trusting any byte. Throws SettingError unless the shapes are of this
  /// owner and this model of its arm. They must also have names and parts, and be sound.
  [[nodiscard]] static FurtherShapes read(std::string_view text, const SettingOwner& owner,
                                          const ArmModel& arm);
};
using FurtherShapesStore = SettingStore<FurtherShapesText>;

}  // namespace corbot
