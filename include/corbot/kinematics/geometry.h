// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>

namespace corbot {

/// Link lengths and D-H offsets of a four-axis arm of the Lynx family: base rotating about z, then three
/// parallel axes (shoulder, elbow, wrist). Source: the paper, Table I ('Start' column) and Table II.
struct ArmGeometry {
  double l0_m{};  ///< table to shoulder axis
  double l1_m{};  ///< shoulder to elbow
  double l2_m{};  ///< elbow to wrist
  double l3_m{};  ///< wrist to tool centre point
  /// Added to θ0 … θ3 in the D-H model; Lynx 5: 0, 10, 0, −45 degrees.
  std::array<double, 4> offset_rad{};
};

}  // namespace corbot
