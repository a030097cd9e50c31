// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <optional>

#include "corbot/kinematics/closed_form.h"

namespace corbot {

/// An arm without a closed form. Forward uses its axes; the planner solves the inverse numerically.
///
/// With four or five joints it follows as many angles as it has joints besides three. The followed angles
/// belong to the turning joints, from the last inwards. Each is the angle by which all joints turn the tool
/// about that joint's axis, with the axes at zero. For an arm that would be a PlanarArm but for its wrist,
/// these are pitch and roll.
struct OtherArm {
  static constexpr const char* kName = "other";
  static constexpr ArmKind kKind = ArmKind::kOther;
  static constexpr const char* kJoints = "";
  static constexpr const char* kSingularPlaces =
      "not known in closed form: look at the smallest singular value";

  JointChain chain{};

  [[nodiscard]] static std::optional<OtherArm> recognise(const JointChain& chain) noexcept {
    return OtherArm{chain};
  }
  [[nodiscard]] std::uint32_t solution_count() const noexcept { return 0; }
  [[nodiscard]] Follows follows() const noexcept {
    return chain.count == 6 ? Follows::kFull : Follows::kNone;
  }
  void set_frames(const Pose& base_T_0, const Pose& n_T_tool) noexcept {
    chain.base_T_0 = base_T_0;
    chain.n_T_tool = n_T_tool;
  }
  [[nodiscard]] Pose forward(const Joints& q) const noexcept { return corbot::forward(chain, q); }
  [[nodiscard]] FollowedAngles followed() const noexcept {
    FollowedAngles angles;
    if (chain.count != 4 && chain.count != 5) return angles;
    for (std::size_t k = chain.count; k-- > 0 && angles.count + 3 < chain.count;) {
      if (chain.axes[k].kind != JointKind::kRotary) continue;
      Joints& row = angles.rows[angles.count++];
      for (std::size_t i = 0; i < chain.count; ++i) {
        const double share = dot(chain.axes[i].direction, chain.axes[k].direction);
        row[i] = chain.axes[i].kind == JointKind::kRotary && std::abs(share) > kRecognised ? share : 0.0;
      }
    }
    return angles;
  }
  [[nodiscard]] IkSolution inverse_at(const Vector3&, const Angles&, std::uint32_t,
                                      const Joints&) const noexcept {
    return {IkStatus::kNoSolution};
  }
  [[nodiscard]] IkSolution inverse(const Pose&, std::uint32_t, const Joints&) const noexcept {
    return {IkStatus::kNoSolution};
  }
};

}  // namespace corbot
