// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cmath>
#include <numbers>
#include <random>

#include "corbot/kinematics/dh_table.h"

namespace corbot::test {

/// Random tables of each family, with right angles where the family needs them and anything elsewhere.
struct RandomArm {
  std::mt19937_64 random;

  double between(double lower, double upper) {
    return std::uniform_real_distribution<double>(lower, upper)(random);
  }
  double angle() { return between(-std::numbers::pi, std::numbers::pi); }
  double length() { return between(0.05, 0.5); }
  double offset() { return coin() ? 0.0 : between(-0.1, 0.1); }
  bool coin() { return (random() & 1u) != 0; }
  double sign() { return coin() ? 1.0 : -1.0; }
  double square() { return sign() * std::numbers::pi / 2; }
  double straight() { return coin() ? 0.0 : std::numbers::pi; }
  double tiny() { return sign() * std::pow(10.0, between(-16.0, -3.0)); }

  Quaternion rotation() {
    std::normal_distribution<double> normal;
    return normalised({normal(random), normal(random), normal(random), normal(random)});
  }
  Pose frame(double reach_m) {
    return {{between(-reach_m, reach_m), between(-reach_m, reach_m), between(-reach_m, reach_m)}, rotation()};
  }
  DhRow turning(double a_m, double alpha_rad) {
    return {JointKind::kRotary, angle(), offset(), a_m, alpha_rad};
  }
  DhRow sliding(double theta_rad, double a_m, double alpha_rad) {
    return {JointKind::kPrismatic, theta_rad, offset(), a_m, alpha_rad};
  }
  DhTable stand(DhTable table) {
    table.base_T_0 = coin() ? frame(0.5) : Pose{};
    table.n_T_tool = coin() ? frame(0.1) : Pose{};
    return table;
  }

  DhTable planar(std::uint32_t joints) {
    DhTable table;
    table.count = joints;
    table.rows[0] = turning(offset(), square());
    table.rows[1] = turning(length(), straight());
    table.rows[2] = turning(length(), joints == 3 ? angle() : straight());
    if (joints > 3) table.rows[3] = joints == 4 ? turning(length(), angle()) : turning(offset(), square());
    if (joints > 4) {
      table.rows[4] = turning(coin() ? 0.0 : between(-0.02, 0.02), angle());
      table.rows[4].d_m = length();
    }
    table = stand(table);
    // Farther off its roll axis than the arm is long, a tool makes the projection meaningless.
    if (joints > 4)
      table.n_T_tool.position_m = {between(-0.01, 0.01), between(-0.01, 0.01), between(-0.01, 0.01)};
    return table;
  }
  DhTable scara(std::uint32_t joints) {
    DhTable table;
    table.count = joints;
    const std::uint32_t slide = std::uniform_int_distribution<std::uint32_t>(0, joints - 1)(random);
    for (std::uint32_t i = 0; i < joints; ++i) {
      table.rows[i] = i == slide ? sliding(angle(), 0.0, straight()) : turning(length(), straight());
    }
    return stand(table);
  }
  DhTable gantry(std::uint32_t joints) {
    DhTable table;
    table.count = joints;
    table.rows[0] = sliding(angle(), offset(), square());
    table.rows[1] = sliding(square() + between(-0.3, 0.3), offset(), square());
    table.rows[2] = sliding(angle(), offset(), angle());
    if (joints > 3) table.rows[3] = turning(offset(), angle());
    return stand(table);
  }
  /// Slides in any three directions that are not nearly in one plane.
  DhTable gantry_with_wrist() {
    DhTable table;
    table.count = 6;
    table.rows[0] = sliding(angle(), 0.0, between(0.6, 2.4));
    table.rows[1] = sliding(square() + between(-0.3, 0.3), 0.0, between(0.6, 2.4));
    table.rows[2] = sliding(angle(), offset(), angle());
    table.rows[3] = turning(0.0, square());
    table.rows[4] = turning(0.0, square());
    table.rows[4].d_m = 0.0;
    table.rows[5] = turning(offset(), angle());
    return stand(table);
  }
  DhTable cylindrical(std::uint32_t joints) {
    DhTable table;
    table.count = joints;
    const bool lift_first = coin();
    table.rows[0] = turning(offset(), lift_first ? straight() : square());
    table.rows[1] = sliding(straight(), offset(), square());
    table.rows[2] = sliding(straight(), offset(), joints == 3 ? angle() : lift_first ? square() : straight());
    if (joints > 3) table.rows[3] = turning(offset(), angle());
    return stand(table);
  }
  DhTable polar(std::uint32_t joints) {
    DhTable table;
    table.count = joints;
    table.rows[0] = turning(offset(), square());
    table.rows[1] = turning(offset(), square());
    table.rows[2] = sliding(angle(), offset(), angle());
    if (joints > 3) {
      table.rows[3] = turning(0.0, square());
      table.rows[4] = turning(0.0, square());
      table.rows[4].d_m = 0.0;
      table.rows[5] = turning(offset(), angle());
    }
    return stand(table);
  }
  /// Base, shoulder, elbow, and a spherical wrist at the end of a forearm that may point anywhere.
  DhTable ortho_parallel() {
    DhTable table;
    table.count = 6;
    table.rows[0] = turning(offset(), square());
    table.rows[1] = turning(length(), straight());
    table.rows[2] = turning(offset(), coin() ? square() : angle());
    table.rows[3] = turning(0.0, square());
    table.rows[3].d_m = length();
    table.rows[4] = turning(0.0, square());
    table.rows[4].d_m = 0.0;
    table.rows[5] = turning(offset(), angle());
    return stand(table);
  }
  DhTable parallel_axes() {
    DhTable table;
    table.count = 6;
    table.rows[0] = turning(offset(), square());
    table.rows[1] = turning(length(), straight());
    table.rows[2] = turning(length(), straight());
    table.rows[3] = turning(offset(), square());
    table.rows[4] = turning(0.0, square());
    table.rows[4].d_m = sign() * length();  // with none the wrist may be a spherical one
    table.rows[5] = turning(offset(), angle());
    return stand(table);
  }
};

}  // namespace corbot::test
