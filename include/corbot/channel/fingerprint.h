// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <bit>
#include <cstdint>

#include "corbot/arm/arm_model.h"

namespace corbot {

/// FNV-1a, 64 bits, over the fields of the model on which planner and real-time task must agree. These are
/// kind, degrees of freedom, kinematics, limits, gripper travel, and loop period. It takes field by field,
/// since padding has no defined value; +0 and −0 are the same. The servo map is left out: recalibrating a
/// servo changes pulses, not the meaning of a command or a snapshot. Source: Fowler, Noll, Vo, "The FNV
/// Non-Cryptographic Hash Algorithm", IETF draft-eastlake-fnv.
class Fnv1a {
 public:
  void add(std::uint64_t value) noexcept {
    for (int byte = 0; byte < 8; ++byte) {
      hash_ = (hash_ ^ ((value >> (8 * byte)) & 0xff)) * 0x100000001b3;
    }
  }
  void add(double value) noexcept { add(std::bit_cast<std::uint64_t>(value + 0.0)); }
  [[nodiscard]] std::uint64_t value() const noexcept { return hash_; }

 private:
  std::uint64_t hash_{0xcbf29ce484222325};
};

inline void add(Fnv1a& hash, const Pose& pose) noexcept {
  for (const double value : pose.position_m) hash.add(value);
  const Quaternion& q = pose.orientation;
  for (const double value : {q.w, q.x, q.y, q.z}) hash.add(value);
}

/// Adds the axes, and the family that was recognised from them.
inline void add(Fnv1a& hash, const Kinematics& kinematics) noexcept {
  const JointChain& chain = kinematics.chain();
  hash.add(static_cast<std::uint64_t>(kinematics.form().index()));
  hash.add(static_cast<std::uint64_t>(chain.count));
  for (const JointAxis& axis : chain.axes) {
    hash.add(static_cast<std::uint64_t>(axis.kind));
    for (const double value : axis.direction) hash.add(value);
    for (const double value : axis.point_m) hash.add(value);
  }
  add(hash, chain.zero_T_n);
  add(hash, chain.base_T_0);
  add(hash, chain.n_T_tool);
}

/// Adds the shapes without their names, which change no motion. fingerprint() leaves the workspace out: the
/// meaning of a position or a soft limit does not depend on it.
template <class Shapes>
void hash_shapes(Fnv1a& hash, const Shapes& workspace) noexcept {
  for (std::size_t k = 0; k < workspace.count; ++k) {
    const WorkspaceShape& shape = workspace.shapes[k];
    for (const std::uint32_t value : {static_cast<std::uint32_t>(shape.kind), shape.parts, shape.face_count})
      hash.add(static_cast<std::uint64_t>(value));
    for (std::size_t i = 0; i < shape.face_count; ++i) {
      for (const double value : shape.faces[i].normal) hash.add(value);
      hash.add(shape.faces[i].offset_m);
    }
  }
}
inline void add(Fnv1a& hash, const WorkspaceLimits& workspace) noexcept {
  hash_shapes(hash, workspace);
  for (const double radius_m : workspace.link_radius_m) hash.add(radius_m);
}

/// Returns the number by which a command names the further shapes that it was planned with; none: 0.
[[nodiscard]] inline std::uint64_t number_of(const FurtherShapes& further) noexcept {
  if (further.count == 0) return 0;
  Fnv1a hash;
  hash_shapes(hash, further);
  return hash.value();
}

[[nodiscard]] inline std::uint64_t fingerprint(const ArmModel& model) noexcept {
  Fnv1a hash;
  hash.add(static_cast<std::uint64_t>(model.kind));
  hash.add(static_cast<std::uint64_t>(model.dof));
  add(hash, model.kinematics);
  for (const JointLimits& joint : model.joints) {
    for (const double value :
         {joint.lower_q, joint.upper_q, joint.speed_q_s, joint.acceleration_q_s2, joint.jerk_q_s3}) {
      hash.add(value);
    }
  }
  hash.add(model.orientation_error_rad);
  const PathLimits& path = model.path;
  for (const double value :
       {path.speed_m_s, path.acceleration_m_s2, path.jerk_m_s3, path.rotation_speed_rad_s,
        path.rotation_acceleration_rad_s2, path.rotation_jerk_rad_s3}) {
    hash.add(value);
  }
  hash.add(model.gripper.travel_s);
  hash.add(static_cast<std::uint64_t>(model.period_ns));
  return hash.value();
}

}  // namespace corbot
