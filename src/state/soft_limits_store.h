// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>

#include "corbot/arm/joint_ranges.h"
#include "state/setting_store.h"

namespace corbot {

/// Soft limits as TOML in degrees, which a person can read, too.
struct SoftLimitsText {
  using Value = JointRanges;
  static constexpr const char* kSuffix = ".limits";
  static constexpr std::size_t kMostBytes = 4096;

  [[nodiscard]] static std::string write(const JointRanges& limits, const SettingOwner& owner,
                                         const ArmModel& arm);
  /// Reads the output of write() without trusting any byte. Throws SettingError unless the limits are of this
  /// owner and this model of its arm. They must also be finite, in order, and within the joints' ranges.
  [[nodiscard]] static JointRanges read(std::string_view text, const SettingOwner& owner,
                                        const ArmModel& arm);
};
using SoftLimitsStore = SettingStore<SoftLimitsText>;

}  // namespace corbot
