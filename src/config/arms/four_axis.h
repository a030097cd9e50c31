// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <numbers>

#include "corbot/kinematics/dh_table.h"

namespace corbot::config {

/// Link lengths and D-H offsets of a four-axis arm of the Lynx family. Its base rotates about z; three
/// parallel axes follow (shoulder, elbow, wrist). Source: the paper, Table I ('Start' column) and Table II.
struct FourAxisLengths {
  double l0_m{};  ///< table to shoulder axis
  double l1_m{};  ///< shoulder to elbow
  double l2_m{};  ///< elbow to wrist
  double l3_m{};  ///< wrist to tool centre point
  /// Added to θ0 … θ3; Lynx 5: 0, 10, 0, −45 degrees.
  std::array<double, 4> offset_rad{};
};

/// Returns the paper's Table II with these lengths, in the standard convention. An angle of 180 degrees
/// occurs twice: the elbow rotates in the opposite direction. The x axis of the last frame and of the tool
/// points along the hand.
[[nodiscard]] inline DhTable four_axis_table(const FourAxisLengths& lengths) {
  constexpr double kPi = std::numbers::pi;
  const std::array<double, 4>& offset = lengths.offset_rad;
  DhTable table;
  table.count = 4;
  table.rows[0] = {JointKind::kRotary, offset[0], lengths.l0_m, 0.0, kPi / 2};
  table.rows[1] = {JointKind::kRotary, offset[1], 0.0, lengths.l1_m, kPi};
  table.rows[2] = {JointKind::kRotary, offset[2], 0.0, lengths.l2_m, kPi};
  table.rows[3] = {JointKind::kRotary, offset[3], 0.0, lengths.l3_m, 0.0};
  // At zero the last frame's y points down; the tool's frame, like CartCoord's, has x along the hand and z
  // upward.
  table.n_T_tool.orientation = about({1.0, 0.0, 0.0}, -kPi / 2);
  return table;
}

}  // namespace corbot::config
