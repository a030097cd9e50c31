// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <type_traits>

#include "corbot/kinematics/angles.h"
#include "corbot/kinematics/ik_status.h"
#include "corbot/kinematics/joint_chain.h"
#include "corbot/kinematics/joints.h"
#include "corbot/kinematics/pose.h"
#include "corbot/kinematics/sub_problems.h"

// The interface of a family of arms with closed-form kinematics. To write a family (planar_arm.h is an
// example):
// * Define a struct of plain numbers in a header of its own: lengths, signs and offsets of the joints in a
//   frame of the family's choice. A `Mounting` gives the place of this frame in frame 0. There is no virtual
//   function and no heap, all is `noexcept`, and every loop has a constant bound.
// * Define `recognise(chain)` from the joint axes at zero; it returns nullopt if the arm is not of the
//   family. It ends with `agrees(family, chain)`, so that a family with a wrong derivation recognises
//   nothing.
// * Define `forward` and `inverse` in the family's frame from turn, two_r and zyz. The hint decides every
//   singular case. The family defines the meaning of a solution's number. `inverse` ignores joint limits, and
//   returns every rotary joint next to the hint.
// * Define the texts for people: kName, kKind, kJoints, kSingularPlaces.
// * Add a line in arm_kinematics.h (`Families`), and a file in tests/property/kinematics/poses, which tests a
//   million random poses.

namespace corbot {

/// The paper's RobotType; the order is that of Corbot::RobotKind in robot.idl.
enum class ArmKind : std::uint32_t { kAnthropomorphic, kCartesian, kCylindrical, kPolar, kScara, kOther };

/// The part of an orientation that an arm can take at a position. The rest is an error angle (IkSolution).
enum class Follows : std::uint32_t {
  kFull,          ///< every orientation
  kPitchAndRoll,  ///< five joints: the tool's axis stays in the arm's plane
  kPitch,         ///< four joints: inclination within the arm's plane
  kYaw,           ///< rotation about one fixed axis: SCARA, gantry with a wrist
  kNone,          ///< the orientation is an output of the position
};

/// Angles that an arm of fewer than six joints follows instead of an orientation (pitch and roll, yaw), each
/// a sum of joints.
using Angles = std::array<double, 2>;
struct FollowedAngles {
  std::uint32_t count{};         ///< 0 if the arm follows an orientation, or none
  std::array<Joints, 2> rows{};  ///< angle = row · joints + zero
  Angles zero_rad{};

  [[nodiscard]] Angles at(const Joints& q) const noexcept {
    Angles angles{};
    for (std::size_t k = 0; k < count; ++k) {
      angles[k] = zero_rad[k];
      for (std::size_t i = 0; i < kMaxJoints; ++i) angles[k] += rows[k][i] * q[i];
    }
    return angles;
  }
};

[[nodiscard]] inline bool is_finite(const Joints& q) noexcept {
  return std::isfinite(q[0] + q[1] + q[2] + q[3] + q[4] + q[5]);
}

/// A bound above the solutions of every family here, and of a general six-axis arm (Raghavan and Roth 1993).
inline constexpr std::size_t kMaxSolutions = 16;

struct IkSolution {
  IkStatus status{IkStatus::kNotFinite};
  Joints joints_q{};  ///< all zero unless status is kOk; limits are not checked
  /// The angle between the wanted orientation and that of these joints; the position is kept.
  double orientation_error_rad{};
  /// For kTooFar and kTooClose: the distance that the target needs inside the arm, and the limit that it
  /// breaks.
  double distance_m{};
  double limit_m{};
  /// The distances that two links allow besides; 0 and 0 if the limit is not one of two links.
  double least_m{}, most_m{};
};

/// Places a family's own frame: base_T_tool = base · K(q) · hand, K the family's motion in its frame. Base
/// and tool may change at run time; the numbers inside the arm do not.
struct Mounting {
  Pose zero_T_family{};    ///< family's frame in frame 0
  Pose last_T_n{};         ///< flange in the last frame of the family's motion
  Pose base{};             ///< base_T_0 · zero_T_family
  Pose hand{};             ///< last_T_n · n_T_tool
  Quaternion unhand{};     ///< the hand's inverse rotation
  bool level{true};        ///< the base is moved, but not turned
  bool upright{true};      ///< the family's z axis points upward
  double heading_rad{};    ///< heading of the family's x axis in the base frame
  double tool_tilt_rad{};  ///< tilt of the tool's x axis, from x towards z of the last frame

  void set_frames(const Pose& base_T_0, const Pose& n_T_tool) noexcept {
    base = base_T_0 * zero_T_family;
    hand = last_T_n * n_T_tool;
    base.orientation = normalised(base.orientation);
    hand.orientation = normalised(hand.orientation);
    for (double& x : hand.position_m) {
      if (std::abs(x) < kRounding_m) x = 0.0;  // a tool that is off its axis by rounding is on it
    }
    unhand = conjugate(hand.orientation);
    const Vector3 tool = rotate(hand.orientation, {1.0, 0.0, 0.0});
    tool_tilt_rad = std::atan2(tool[2], tool[0]);
    const Vector3 ahead = rotate(base.orientation, {1.0, 0.0, 0.0});
    heading_rad = std::atan2(ahead[1], ahead[0]);
    upright = rotate(base.orientation, {0.0, 0.0, 1.0})[2] > 1.0 - 1e-9;
    const Quaternion& q = base.orientation;
    level = q.x == 0.0 && q.y == 0.0 && q.z == 0.0;
  }
  /// Converts the last frame, or the tool's frame, in the family's frame to base_T_tool.
  [[nodiscard]] Pose to_base(const Pose& last) const noexcept { return tool_to_base(last * hand); }
  [[nodiscard]] Pose tool_to_base(const Pose& tool) const noexcept {
    return level ? Pose{base.position_m + tool.position_m, tool.orientation} : base * tool;
  }
  [[nodiscard]] Vector3 to_family(const Vector3& position_m) const noexcept {
    const Vector3 away = position_m - base.position_m;
    return level ? away : rotate(conjugate(base.orientation), away);
  }
  /// Converts base_T_tool to the family's frame, with a quaternion of unit length.
  [[nodiscard]] Pose to_family(const Pose& pose) const noexcept {
    if (level) return {pose.position_m - base.position_m, normalised(pose.orientation)};
    const Quaternion q = conjugate(base.orientation);
    return {rotate(q, pose.position_m - base.position_m), q * normalised(pose.orientation)};
  }
};

/// Builds the mounting from the frames that `recognise` has chosen: zero_T_family, and the family's last
/// frame at zero.
[[nodiscard]] inline Mounting mounting(const JointChain& chain, const Pose& zero_T_family,
                                       const Pose& family_T_last) noexcept {
  Mounting m;
  m.zero_T_family = zero_T_family;
  m.last_T_n = inverse_of(zero_T_family * family_T_last) * chain.zero_T_n;
  m.set_frames(chain.base_T_0, chain.n_T_tool);
  return m;
}

// clang-format off
template <class T>
concept ClosedForm = std::is_trivially_copyable_v<T> && requires(const T form, T changed, const Joints& q,
                                                                  const Pose& pose, std::uint32_t number) {
  { T::kName } -> std::convertible_to<const char*>;
  { T::kKind } -> std::convertible_to<ArmKind>;
  // From the base, R turning, P sliding: "RRP RRPR".
  { T::kJoints } -> std::convertible_to<const char*>;
  { T::kSingularPlaces } -> std::convertible_to<const char*>;  // in words, for people
  { T::recognise(JointChain{}) } noexcept -> std::same_as<std::optional<T>>;
  { form.solution_count() } noexcept -> std::same_as<std::uint32_t>;  // numbers 0 … count − 1
  { form.follows() } noexcept -> std::same_as<Follows>;
  { form.forward(q) } noexcept -> std::same_as<Pose>;
  { form.inverse(pose, number, q) } noexcept -> std::same_as<IkSolution>;
  { changed.set_frames(pose, pose) } noexcept;  // base_T_0, n_T_tool
};

/// A family may solve all numbers at once if they share much of the work. Then all[number] is inverse(pose,
/// number, hint).
template <class T>
concept SolvesAll = ClosedForm<T> && requires(const T form, const Pose& pose, const Joints& hint,
                                               std::array<IkSolution, T::kSolutions>& all) {
  { form.inverse_all(pose, hint, all) } noexcept;
};

/// The additional members of a family that does not follow every orientation. They are the angles that it
/// follows, and the inverse for a position and these angles, or for the position alone if there are none. An
/// arm of the family that follows every orientation returns kNoSolution.
template <class T>
concept FollowsAngles = requires(const T form, const Joints& q, const Vector3& position_m,
                                 const Angles& angles, std::uint32_t number) {
  { form.followed() } noexcept -> std::same_as<FollowedAngles>;
  { form.inverse_at(position_m, angles, number, q) } noexcept -> std::same_as<IkSolution>;
};
// clang-format on

/// Compares two families: the same poses within 1e-9 m and rad over a fixed set of joints in all quadrants.
/// Computing noise is 1e-15; a wrong sign is millimetres.
template <class Form>
[[nodiscard]] bool agrees(const Form& form, const JointChain& chain) noexcept {
  for (int k = 0; k < 24; ++k) {
    Joints q{};
    for (std::size_t i = 0; i < chain.count; ++i) {
      const double step = 0.61803398874989485 * static_cast<double>((k + 1) * static_cast<int>(i + 2));
      const double spread = step - std::nearbyint(step);  // −0.5 … 0.5
      q[i] = chain.axes[i].kind == JointKind::kRotary ? 6.0 * spread : spread;
    }
    const Pose a = form.forward(q);
    const Pose b = corbot::forward(chain, q);
    if (!(norm(a.position_m - b.position_m) < 1e-9) ||
        !(angle_between(a.orientation, b.orientation) < 1e-9)) {
      return false;
    }
  }
  return true;
}

/// For arms whose orientation is an output: adds its distance from the wanted one.
template <class Form>
[[nodiscard]] IkSolution with_output_told(const Form& form, IkSolution solution, const Pose& pose) noexcept {
  if (solution.status == IkStatus::kOk) {
    solution.orientation_error_rad =
        angle_between(form.forward(solution.joints_q).orientation, normalised(pose.orientation));
  }
  return solution;
}

[[nodiscard]] constexpr IkStatus to_status(Reach reach) noexcept {
  if (reach == Reach::kOk) return IkStatus::kOk;
  return reach == Reach::kTooFar ? IkStatus::kTooFar : IkStatus::kTooClose;
}
/// Returns a refusal with the needed distance and the possible one.
[[nodiscard]] inline IkSolution refused(const Turn& t, double b) noexcept {
  return {to_status(t.reach), {}, 0.0, t.distance_m, std::abs(b)};
}
[[nodiscard]] inline IkSolution refused(const TwoLinks& t, double l1, double l2) noexcept {
  const double least_m = std::abs(l1 - l2), most_m = l1 + l2;
  return {to_status(t.reach),
          {},
          0.0,
          t.distance_m,
          t.reach == Reach::kTooFar ? most_m : least_m,
          least_m,
          most_m};
}

/// The tolerance of recognition: lengths of 1e-9 m and angles of 1e-9 rad count as zero. The caller must
/// first snap a less exact table (a URDF with 1.5708).
inline constexpr double kRecognised = 1e-9;
[[nodiscard]] inline bool parallel(const Vector3& a, const Vector3& b) noexcept {
  return norm(cross(a, b)) < kRecognised;
}
[[nodiscard]] inline bool square(const Vector3& a, const Vector3& b) noexcept {
  return std::abs(dot(a, b)) < kRecognised;
}

}  // namespace corbot
