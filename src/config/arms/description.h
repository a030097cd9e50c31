// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>

#include "corbot/kinematics/dh_table.h"
#include "corbot/kinematics/joint_chain.h"
#include "corbot/kinematics/joints.h"

namespace corbot::config {

/// By what `[geometry]` describes an arm.
enum class GeometryForm : std::uint32_t {
  kLengths,  ///< the four lengths and offsets of the paper's Table II
  kDh,       ///< a D-H table, one row a joint
  kUrdf      ///< a chain of a URDF
};

/// An arm's geometry as its profile gives it, before it was snapped, for those who explain it. What moves the arm is
/// ArmModel::kinematics. Table values are those of the D-H table or the URDF; a joint value is the table value less home.
struct ArmDescription {
  GeometryForm form{GeometryForm::kLengths};
  DhTable table{};        ///< by table values; count 0 where a URDF was given
  JointChain given{};     ///< by table values
  Joints home_q{};        ///< table value at joint value 0
  std::string urdf{};     ///< file, or "inline"
  std::string reason{};   ///< why no family takes the arm; empty where one does
  double difference_m{};  ///< by which snapping moved the tool at most: recognise.h
  double difference_rad{};
};

/// The same arm by joint values: every axis where it is when the joints are at home.
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

/// The same, row by row, without rounding but that of one addition.
[[nodiscard]] inline DhTable at_home(DhTable table, const Joints& home_q) noexcept {
  for (std::size_t i = 0; i < table.count; ++i) {
    DhRow& row = table.rows[i];
    (row.kind == JointKind::kRotary ? row.theta_rad : row.d_m) += home_q[i];
  }
  return table;
}

}  // namespace corbot::config
