// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>

#include "corbot/kinematics/joint_chain.h"

// Points and links of an arm that a shape of its workspace can hold for. Real-time safe.

namespace corbot {

enum class ArmPart : std::uint32_t {
  kTool,      ///< the tool centre point
  kWrist,     ///< on the last axis from joint 4 on that misses the flange; if none does, the flange
  kElbow,     ///< on the axis of joint 3 if it turns, else of joint 2
  kUpperArm,  ///< from the shoulder to the elbow; the shoulder is on the axis of the joint before the elbow's
  kForearm,   ///< from the elbow to the wrist; if there is no wrist, to the tool centre point
  kHand       ///< from the wrist to the tool centre point
};
inline constexpr std::size_t kArmParts = 6;
inline constexpr std::array<const char*, kArmParts> kPartNames{"tool",      "wrist",   "elbow",
                                                               "upper arm", "forearm", "hand"};
inline constexpr std::size_t kFirstLink = 3;  ///< the parts before it are points
inline constexpr std::size_t kArmLinks = kArmParts - kFirstLink;

/// Returns the part's bit in a set of parts.
[[nodiscard]] constexpr std::uint32_t bit_of(std::size_t part) noexcept { return 1u << part; }

inline constexpr std::uint32_t kAllParts = (1u << kArmParts) - 1;

/// A point that the first `joints` joints of a chain move.
struct PartPoint {
  bool exists{};
  std::size_t joints{};
  Vector3 zero_m{};  ///< at zero joints, frame 0
};
inline constexpr std::size_t kArmPoints = 4;  ///< tool, wrist, elbow, and the shoulder
using ArmPoints = std::array<PartPoint, kArmPoints>;

/// The points between which a part lies, by their places in ArmPoints. Those of a point are the same.
struct PartEnds {
  bool exists{};
  std::size_t from{}, to{};
};
using ArmParts = std::array<PartEnds, kArmParts>;

/// Returns the point of a turning joint's axis that is nearest to this point.
[[nodiscard]] inline Vector3 foot_on(const JointAxis& axis, const Vector3& point_m) noexcept {
  return axis.point_m + dot(axis.direction, point_m - axis.point_m) * axis.direction;
}

/// Returns the points of this arm. An arm has a wrist if a joint from joint 4 on turns.
[[nodiscard]] inline ArmPoints points_of(const JointChain& chain) noexcept {
  constexpr double kMissed_m = 1e-6;
  const auto turns = [&chain](std::size_t i) {
    return i < chain.count && chain.axes[i].kind == JointKind::kRotary;
  };
  ArmPoints parts{};
  parts[0] = {true, chain.count, (chain.zero_T_n * chain.n_T_tool).position_m};
  const Vector3& flange_m = chain.zero_T_n.position_m;
  Vector3 beyond_m = flange_m;  // the point whose foot is the elbow
  for (std::size_t i = chain.count; i-- > 3;) {
    if (!turns(i)) continue;
    if (!parts[1].exists) parts[1] = {true, chain.count, flange_m};
    const Vector3 foot_m = foot_on(chain.axes[i], flange_m);
    if (norm(foot_m - flange_m) <= kMissed_m) continue;
    parts[1] = {true, i, foot_m};
    beyond_m = foot_m;
    break;
  }
  const std::size_t elbow = turns(2) ? 2 : 1;
  if (!turns(elbow)) return parts;
  parts[2] = {true, elbow, foot_on(chain.axes[elbow], beyond_m)};
  if (turns(elbow - 1)) parts[3] = {true, elbow - 1, foot_on(chain.axes[elbow - 1], parts[2].zero_m)};
  return parts;
}

/// Returns the parts of an arm with these points.
[[nodiscard]] inline ArmParts parts_of(const ArmPoints& points) noexcept {
  ArmParts parts{};
  for (std::size_t k = 0; k < kFirstLink; ++k) parts[k] = {points[k].exists, k, k};
  const auto link = [&points](std::size_t from, std::size_t to) {
    return PartEnds{points[from].exists && points[to].exists, from, to};
  };
  const std::size_t hand = points[1].exists ? 1 : 0;
  parts[3] = link(3, 2);
  parts[4] = link(2, hand);
  if (hand == 1) parts[5] = link(1, 0);
  return parts;
}

/// Place and derivatives of a point, base frame.
struct PartState {
  Vector3 position_m{};
  std::array<Vector3, kMaxJoints>
      per_q{};  ///< d(position)/dq of each joint; zero if it does not move the point
};

using ArmStates = std::array<PartState, kArmPoints>;

/// Computes the states of all points that exist.
[[nodiscard]] inline ArmStates part_states(const JointChain& chain, const ArmPoints& parts,
                                           const Joints& q) noexcept {
  ArmStates states{};
  std::array<Vector3, kMaxJoints> direction{}, point{};
  Pose pose = chain.base_T_0;
  for (std::size_t i = 0; i <= chain.count; ++i) {
    for (std::size_t k = 0; k < kArmPoints; ++k) {
      if (!parts[k].exists || parts[k].joints != i) continue;
      states[k].position_m = pose.position_m + rotate(pose.orientation, parts[k].zero_m);
      for (std::size_t j = 0; j < i; ++j) {
        const bool turns = chain.axes[j].kind == JointKind::kRotary;
        states[k].per_q[j] = turns ? cross(direction[j], states[k].position_m - point[j]) : direction[j];
      }
    }
    if (i == chain.count) break;
    direction[i] = rotate(pose.orientation, chain.axes[i].direction);
    point[i] = pose.position_m + rotate(pose.orientation, chain.axes[i].point_m);
    pose = pose * displacement(chain.axes[i], q[i]);
  }
  return states;
}

}  // namespace corbot
