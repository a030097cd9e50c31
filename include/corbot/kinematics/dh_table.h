// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>

#include "corbot/kinematics/joint_chain.h"
#include "corbot/kinematics/joints.h"
#include "corbot/kinematics/pose.h"

namespace corbot {

/// The place of a row's link. Standard (distal): Rz(theta) Tz(d) Tx(a) Rx(alpha). Modified (proximal; Craig):
/// Rx(alpha) Tx(a) Rz(theta) Tz(d). The two look alike, so a table's author must name the convention.
enum class DhConvention : std::uint32_t { kStandard, kModified };

/// A row of a table. A rotary joint's value is added to theta, a prismatic one's to d.
struct DhRow {
  JointKind kind{JointKind::kRotary};
  double theta_rad{};
  double d_m{};
  double a_m{};
  double alpha_rad{};
};

/// A Denavit-Hartenberg table: base_T_tool = base_T_0 · (rows) · n_T_tool.
struct DhTable {
  std::uint32_t count{};  ///< joints, 1 … kMaxJoints
  std::array<DhRow, kMaxJoints> rows{};
  Pose base_T_0{};
  Pose n_T_tool{};
  DhConvention convention{DhConvention::kStandard};
};

/// A rotation matrix and a position. The textbook's matrices are multiplied here, so that the product can
/// check the families, which compute in other ways.
struct DhFrame {
  Matrix3 rotation{Vector3{1.0, 0.0, 0.0}, Vector3{0.0, 1.0, 0.0}, Vector3{0.0, 0.0, 1.0}};
  Vector3 position_m{};
};

[[nodiscard]] constexpr DhFrame operator*(const DhFrame& a, const DhFrame& b) noexcept {
  DhFrame c;
  for (std::size_t i = 0; i < 3; ++i) {
    c.position_m[i] = a.position_m[i] + dot(a.rotation[i], b.position_m);
    for (std::size_t k = 0; k < 3; ++k) {
      c.rotation[i][k] = a.rotation[i][0] * b.rotation[0][k] + a.rotation[i][1] * b.rotation[1][k] +
                         a.rotation[i][2] * b.rotation[2][k];
    }
  }
  return c;
}

namespace detail {

/// Right angles are written as 1.5707963267948966: their cosine must be 0, not 6e-17.
[[nodiscard]] inline double exact_cosine(double angle_rad) noexcept {
  const double c = std::cos(angle_rad);
  return std::abs(c) < 1e-15 ? 0.0 : c;
}
[[nodiscard]] inline double exact_sine(double angle_rad) noexcept {
  const double s = std::sin(angle_rad);
  return std::abs(s) < 1e-15 ? 0.0 : s;
}
[[nodiscard]] inline DhFrame screw_z(double theta_rad, double d_m) noexcept {
  const double c = exact_cosine(theta_rad), s = exact_sine(theta_rad);
  return {{Vector3{c, -s, 0.0}, Vector3{s, c, 0.0}, Vector3{0.0, 0.0, 1.0}}, {0.0, 0.0, d_m}};
}
[[nodiscard]] inline DhFrame screw_x(double alpha_rad, double a_m) noexcept {
  const double c = exact_cosine(alpha_rad), s = exact_sine(alpha_rad);
  return {{Vector3{1.0, 0.0, 0.0}, Vector3{0.0, c, -s}, Vector3{0.0, s, c}}, {a_m, 0.0, 0.0}};
}
[[nodiscard]] constexpr DhFrame frame_of(const Pose& pose) noexcept {
  return {to_matrix(pose.orientation), pose.position_m};
}
[[nodiscard]] inline Pose pose_of(const DhFrame& frame) noexcept {
  return {frame.position_m, to_quaternion(frame.rotation)};
}

}  // namespace detail

/// Returns base_T_tool as the product of the table's matrices. It is the reference; real-time safe, but no
/// family uses it.
[[nodiscard]] inline DhFrame product(const DhTable& table, const Joints& q) noexcept {
  DhFrame frame = detail::frame_of(table.base_T_0);
  for (std::size_t i = 0; i < table.count; ++i) {
    const DhRow& row = table.rows[i];
    const bool turns = row.kind == JointKind::kRotary;
    const DhFrame z = detail::screw_z(row.theta_rad + (turns ? q[i] : 0.0), row.d_m + (turns ? 0.0 : q[i]));
    const DhFrame x = detail::screw_x(row.alpha_rad, row.a_m);
    frame = table.convention == DhConvention::kStandard ? frame * z * x : frame * x * z;
  }
  return frame * detail::frame_of(table.n_T_tool);
}

[[nodiscard]] inline Pose forward(const DhTable& table, const Joints& q) noexcept {
  return detail::pose_of(product(table, q));
}

/// Describes the same arm by its axes.
[[nodiscard]] inline JointChain joint_chain(const DhTable& table) noexcept {
  JointChain chain;
  chain.count = table.count;
  chain.base_T_0 = table.base_T_0;
  chain.n_T_tool = table.n_T_tool;
  DhFrame frame;
  for (std::size_t i = 0; i < table.count; ++i) {
    const DhRow& row = table.rows[i];
    const DhFrame z = detail::screw_z(row.theta_rad, row.d_m);
    const DhFrame x = detail::screw_x(row.alpha_rad, row.a_m);
    const bool standard = table.convention == DhConvention::kStandard;
    const DhFrame at = standard ? frame : frame * x;  // the joint's z axis
    chain.axes[i] = {row.kind, {at.rotation[0][2], at.rotation[1][2], at.rotation[2][2]}, at.position_m};
    frame = standard ? frame * z * x : at * z;
  }
  chain.zero_T_n = detail::pose_of(frame);
  return chain;
}

}  // namespace corbot
