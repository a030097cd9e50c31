// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "corbot/kinematics/arm_kinematics.h"
#include "corbot/kinematics/dh_table.h"

namespace corbot::config {

/// Axes that are parallel, perpendicular or crossing within this (rad, m) are treated as exactly so. The
/// tolerance covers a URDF's 1.5708, and is smaller than the manufacturing tolerance of any machine.
inline constexpr double kSnapped = 1e-5;

/// An arm's family, recognised from its axes at zero.
struct RecognisedArm {
  Kinematics kinematics;  ///< of the snapped axes; if no family fits, `OtherArm` of the axes as given
  /// If no family fits: the first condition that fails, for each family with such joints. Otherwise empty.
  std::string reason;
  /// Effect of snapping: the largest difference between the tool's pose by the family and as given, over
  /// random joints (slides within 1 m). It is rounding error if the axes were exact.
  double difference_m{};
  double difference_rad{};
};

/// Snaps the axes, tries the families in turn, and verifies the result at a thousand random joints within
/// 1e-12 of the snapped axes. Not real-time safe.
[[nodiscard]] RecognisedArm recognise_arm(const JointChain& chain);
/// Does the same for a table, standard or modified. The difference is relative to the product of its
/// matrices.
[[nodiscard]] RecognisedArm recognise_arm(const DhTable& table);

/// Returns the axes with exact parallel, perpendicular and crossing axes instead of those within kSnapped.
/// Each axis is aligned with the previous ones by a rotation and a displacement of everything beyond it.
/// Errors therefore do not add up along the arm.
[[nodiscard]] JointChain snapped(const JointChain& chain);

/// Returns why no family accepts these axes.
[[nodiscard]] std::string explain_other(const JointChain& chain);

}  // namespace corbot::config
