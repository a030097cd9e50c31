// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>

#include "corbot/kinematics/dh_table.h"
#include "corbot/kinematics/joint_chain.h"
#include "corbot/kinematics/joints.h"

namespace corbot::config {

/// The form in which `[geometry]` describes an arm.
enum class GeometryForm : std::uint32_t {
  kLengths,  ///< the four lengths and offsets of the paper's Table II
  kDh,       ///< a D-H table, one row for each joint
  kUrdf      ///< a chain of a URDF
};

/// An arm's geometry as in its profile, before snapping, for the functions that explain it.
/// ArmModel::kinematics moves the arm. Table values are those of the D-H table or the URDF; a joint value is
/// the table value minus home.
struct ArmDescription {
  GeometryForm form{GeometryForm::kLengths};
  DhTable table{};        ///< by table values; count 0 for a URDF
  JointChain given{};     ///< by table values
  Joints home_q{};        ///< table value at joint value 0
  std::string urdf{};     ///< file, or "inline"
  std::string reason{};   ///< why no family accepts the arm; empty if one does
  double difference_m{};  ///< the largest change of the tool's position by snapping: recognise.h
  double difference_rad{};
};

/// Returns the same arm by joint values: every axis at its place with the joints at home.
[[nodiscard]] inline JointChain at_home(JointChain chain, const Joints& home_q) noexcept {
  Pose moved;
  for (std::size_t i = 0; i < chain.count; ++i) {
    JointAxis& axis = chain.axes[i];
    const Pose own = displacement(axis, home_q[i]);
    axis.direction = rotate(moved.orientation, axis.direction);
    axis.point_m = moved.position_m + rotate(moved.orientation, axis.point_m);
    moved = moved * own;
  }
  chain.zero_T_n = moved * chain.zero_T_n;
  return chain;
}

/// Does the same row by row, with no rounding except that of one addition.
[[nodiscard]] inline DhTable at_home(DhTable table, const Joints& home_q) noexcept {
  for (std::size_t i = 0; i < table.count; ++i) {
    DhRow& row = table.rows[i];
    (row.kind == JointKind::kRotary ? row.theta_rad : row.d_m) += home_q[i];
  }
  return table;
}

}  // namespace corbot::config
