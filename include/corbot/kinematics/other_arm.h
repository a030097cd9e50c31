// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>

#include "corbot/kinematics/closed_form.h"

namespace corbot {

/// An arm without a closed form: forward by its axes, inverse is for the planner, which solves it numerically.
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
  [[nodiscard]] IkSolution inverse(const Pose&, std::uint32_t, const Joints&) const noexcept {
    return {IkStatus::kNoSolution};
  }
};

}  // namespace corbot
