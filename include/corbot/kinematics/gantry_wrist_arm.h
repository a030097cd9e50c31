// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <optional>

#include "corbot/kinematics/closed_form.h"
#include "corbot/kinematics/spherical_wrist.h"

namespace corbot {

/// Three slides in independent directions with a spherical wrist: PPPRRR, the gantries of factories. Position
/// and orientation are decoupled: the slides take the wrist's centre to its place, and the wrist sets the
/// orientation. Siciliano et al., Robotics, 2009, 2.9 and 2.12.
///
/// Own frame: at the wrist's centre at zero, its axes those of frame 0.
///
/// Solutions: bit 0: the wrist's middle joint is bent to its negative side.
struct GantryWristArm {
  static constexpr const char* kName = "gantry with spherical wrist";
  static constexpr ArmKind kKind = ArmKind::kCartesian;
  static constexpr const char* kJoints = "PPPRRR";
  static constexpr const char* kSingularPlaces = "axes 4 and 6 in line";

  Mounting mount{};
  SphericalWrist wrist{};
  std::array<Vector3, 3> slides{};    ///< their directions
  std::array<Vector3, 3> measures{};  ///< the dual directions: slide i of a displacement d is d · measures[i]

  [[nodiscard]] static std::optional<GantryWristArm> recognise(const JointChain& chain) noexcept {
    if (chain.count != 6) return std::nullopt;
    GantryWristArm arm;
    for (std::size_t i = 0; i < 3; ++i) {
      if (chain.axes[i].kind != JointKind::kPrismatic) return std::nullopt;
      arm.slides[i] = chain.axes[i].direction;
    }
    const double volume = dot(arm.slides[0], cross(arm.slides[1], arm.slides[2]));
    if (std::abs(volume) < 1e-3) return std::nullopt;
    for (std::size_t i = 0; i < 3; ++i) {
      arm.measures[i] = (1.0 / volume) * cross(arm.slides[(i + 1) % 3], arm.slides[(i + 2) % 3]);
    }
    const auto zero_T_wrist = SphericalWrist::zero_T_wrist(chain);
    if (!zero_T_wrist) return std::nullopt;
    const Pose family{zero_T_wrist->position_m, {}};
    arm.wrist = SphericalWrist::on(chain, family, *zero_T_wrist);
    arm.mount = mounting(chain, family, {{}, arm.wrist.rotation({})});
    if (!agrees(arm, chain)) return std::nullopt;
    return arm;
  }

  [[nodiscard]] std::uint32_t solution_count() const noexcept { return 2; }
  [[nodiscard]] Follows follows() const noexcept { return Follows::kFull; }
  void set_frames(const Pose& base_T_0, const Pose& n_T_tool) noexcept {
    mount.set_frames(base_T_0, n_T_tool);
  }

  [[nodiscard]] Pose forward(const Joints& q) const noexcept {
    return mount.to_base({q[0] * slides[0] + q[1] * slides[1] + q[2] * slides[2], wrist.rotation(q)});
  }

  [[nodiscard]] IkSolution inverse(const Pose& pose, std::uint32_t number,
                                   const Joints& hint) const noexcept {
    if (number >= solution_count()) return {IkStatus::kNoSolution};
    if (!is_finite(pose) || !is_finite(hint)) return {};
    const Pose p = mount.to_family(pose);
    const Quaternion g = p.orientation * mount.unhand;
    const Vector3 centre_m = p.position_m - rotate(g, mount.hand.position_m);
    IkSolution solution;
    solution.status = IkStatus::kOk;
    for (std::size_t i = 0; i < 3; ++i) solution.joints_q[i] = dot(centre_m, measures[i]);
    wrist.solve(g, (number & 1u) != 0, hint, solution.joints_q);
    return solution;
  }
};

}  // namespace corbot
