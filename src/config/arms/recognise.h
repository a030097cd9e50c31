// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "corbot/kinematics/arm_kinematics.h"
#include "corbot/kinematics/dh_table.h"

namespace corbot::config {

/// Axes that are parallel, square or crossing within this (rad, m) are meant to be: what a URDF's 1.5708 leaves, and less than any
/// machine is built to.
inline constexpr double kSnapped = 1e-5;

/// An arm's family, as found from its axes at zero.
struct RecognisedArm {
  Kinematics kinematics;  ///< of the snapped axes; `OtherArm`, of the axes as given, where no family fits
  std::string
      reason;  ///< where none fits: for each family with such joints, its first condition that fails; else empty
  /// What snapping changed: the largest difference between the tool's pose by the family and as given, over random joints
  /// (slides within 1 m). Noise of computing where the axes were exact.
  double difference_m{};
  double difference_rad{};
};

/// Snaps, asks the families in turn, and verifies what is found: at a thousand random joints within 1e-12 of the snapped axes.
/// Not real-time safe.
[[nodiscard]] RecognisedArm recognise_arm(const JointChain& chain);
/// Of a table, standard or modified; the difference is that to the product of its matrices.
[[nodiscard]] RecognisedArm recognise_arm(const DhTable& table);

/// The axes with what is parallel, square or crossing within kSnapped made so. Each is brought into line with those before it, by a
/// rotation and a displacement that everything beyond it takes part in, so that errors do not add up along the arm.
[[nodiscard]] JointChain snapped(const JointChain& chain);

/// Why no family takes these axes.
[[nodiscard]] std::string explain_other(const JointChain& chain);

}  // namespace corbot::config
