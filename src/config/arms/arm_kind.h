// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <string_view>
#include <type_traits>

#include "corbot/arm/arm_model.h"
#include "corbot/kinematics/arm_kinematics.h"

namespace corbot::config {

/// Values of `robot.kind` in the order of ArmKind.
inline constexpr std::array<std::string_view, 6> kKindNames{"anthropomorphic", "cartesian", "cylindrical",
                                                            "polar",           "scara",     "other"};
[[nodiscard]] constexpr std::string_view name_of(ArmKind kind) noexcept {
  return kKindNames[static_cast<std::size_t>(kind)];
}

/// Returns the paper's name of this arm family.
[[nodiscard]] inline ArmKind kind_of(const Kinematics& kinematics) noexcept {
  return kinematics.visit([](const auto& form) { return std::remove_cvref_t<decltype(form)>::kKind; });
}

}  // namespace corbot::config
