// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <optional>

#include "corbot/kinematics/closed_form.h"
#include "corbot/kinematics/planar_hand.h"
#include "corbot/kinematics/planar_links.h"

namespace corbot {

/// A base that turns about an axis, two or three parallel axes square to it (shoulder, elbow, wrist), and
/// perhaps a roll square to these. Three to five joints: hobby arms, the Lynx 5. Siciliano et al., Robotics,
/// 2009, chapter 2.
///
/// Own frame: z along axis 1, origin at the shoulder's height, x ahead of the axis on the tool's side at
/// zero. Inclinations count from x towards z: A of the upper arm, B of the forearm, C of the hand. The last
/// frame has its origin on the wrist axis (or at the roll axis' foot beside it), and x along the hand. The
/// tool may be anywhere in it.
///
/// Solutions: bit 0: joint 3 is bent to its negative side (from straight). Bit 1: the base faces away from
/// the point.
struct PlanarArm {
  static constexpr double kConverged_m = 1e-15;
  static constexpr int kMostSteps = 40;
  static constexpr const char* kName = "base and planar arm";
  static constexpr ArmKind kKind = ArmKind::kAnthropomorphic;
  static constexpr const char* kJoints = "RRR RRRR RRRRR";
  static constexpr const char* kSingularPlaces = "elbow stretched or folded; tool (or wrist) on axis 1";

  Mounting mount{};
  std::uint32_t count{};  ///< joints: 3 (no wrist), 4, or 5 (with roll)
  PlanarLinks links{};
  double hand_zero_rad{};  ///< C at zero
  double lateral_m{};  ///< distance of the roll axis from axis 1's plane; without roll the tool's own counts
  double raise_m{};    ///< height of the roll axis above the wrist axis, square to both

  [[nodiscard]] static std::optional<PlanarArm> recognise(const JointChain& chain) noexcept {
    if (chain.count < 3 || chain.count > 5) return std::nullopt;
    for (std::size_t i = 0; i < chain.count; ++i) {
      if (chain.axes[i].kind != JointKind::kRotary) return std::nullopt;
    }
    const auto links = PlanarLinks::recognise(chain);
    if (!links) return std::nullopt;
    PlanarArm arm;
    arm.count = chain.count;
    arm.links = links->first;
    Pose last{arm.count > 3 ? arm.links.wrist_at_zero() : arm.links.elbow_at_zero(), {}};
    if (arm.count > 4) {
      const auto roll = RollAxis::recognise(chain.axes[4], links->second, last.position_m);
      if (!roll) return std::nullopt;
      arm.hand_zero_rad = roll->pitch_rad;
      arm.lateral_m = roll->lateral_m;
      arm.raise_m = roll->raise_m;
      last = roll->frame;
    }
    arm.mount = mounting(chain, links->second, last);
    if (!agrees(arm, chain)) return std::nullopt;
    return arm;
  }

  [[nodiscard]] std::uint32_t solution_count() const noexcept { return 4; }
  [[nodiscard]] Follows follows() const noexcept {
    return count == 5 ? Follows::kPitchAndRoll : count == 4 ? Follows::kPitch : Follows::kNone;
  }
  void set_frames(const Pose& base_T_0, const Pose& n_T_tool) noexcept {
    mount.set_frames(base_T_0, n_T_tool);
  }

  [[nodiscard]] Pose forward(const Joints& q) const noexcept {
    const double a = links.sign2 * q[1] + links.upper_zero_rad;
    double r = links.shoulder_m + links.upper_m * std::cos(a);
    double z = links.upper_m * std::sin(a);
    double hand = links.sign2 * q[1] + links.sign3 * q[2];
    if (count > 3) {
      const double b = hand + links.fore_zero_rad;
      r += links.fore_m * std::cos(b);
      z += links.fore_m * std::sin(b);
      hand += links.sign4 * q[3] + hand_zero_rad;
    }
    const double ct = std::cos(0.5 * q[0]), st = std::sin(0.5 * q[0]);
    const double ch = std::cos(0.5 * hand), sh = std::sin(0.5 * hand);
    Pose last{{}, {ct * ch, st * sh, -ct * sh, st * ch}};  // Rz(θ) Ry(−C)
    const double cosine = (ct - st) * (ct + st), sine = 2.0 * st * ct;
    const double ahead = (ch - sh) * (ch + sh), up = 2.0 * sh * ch;
    if (count < 5) {  // the tool stays in its plane
      const Vector3& tool = mount.hand.position_m;
      r += tool[0] * ahead - tool[2] * up;
      last.orientation = last.orientation * mount.hand.orientation;
      last.position_m = {r * cosine - tool[1] * sine, r * sine + tool[1] * cosine,
                         z + tool[0] * up + tool[2] * ahead};
      return mount.tool_to_base(last);
    }
    r -= raise_m * up;
    last.position_m = {r * cosine - lateral_m * sine, r * sine + lateral_m * cosine, z + raise_m * ahead};
    last.orientation = last.orientation * about({1.0, 0.0, 0.0}, q[4]);
    return mount.to_base(last);
  }

  [[nodiscard]] IkSolution inverse(const Pose& pose, std::uint32_t number,
                                   const Joints& hint) const noexcept {
    if (number >= solution_count()) return {IkStatus::kNoSolution};
    if (!is_finite(pose) || !is_finite(hint)) return {};
    const Pose p = mount.to_family(pose);
    if (count == 5) return with_roll(p, number, hint);
    if (count == 4) return with_wrist(p, number, hint);
    return with_output_told(*this, without_wrist(p.position_m, number, hint), pose);
  }

  /// Returns the angles that this arm follows, as sums of joints: C, then the roll.
  [[nodiscard]] FollowedAngles followed() const noexcept {
    return {count - 3,
            {Joints{0.0, links.sign2, links.sign3, links.sign4}, Joints{0.0, 0.0, 0.0, 0.0, 1.0}},
            {hand_zero_rad}};
  }
  /// Returns joints for a position and these angles instead of an orientation.
  [[nodiscard]] IkSolution inverse_at(const Vector3& position_m, const Angles& angles, std::uint32_t number,
                                      const Joints& hint) const noexcept {
    if (number >= solution_count()) return {IkStatus::kNoSolution};
    if (!std::isfinite(position_m[0] + position_m[1] + position_m[2] + angles[0] + angles[1]) ||
        !is_finite(hint))
      return {};
    const Vector3 p = mount.to_family(position_m);
    if (count == 3) return without_wrist(p, number, hint);
    const Vector3& tool = mount.hand.position_m;
    PlanarHand hand{angles[0], std::cos(angles[0]), std::sin(angles[0])};
    if (count == 4) {
      const Turn t = turn(p[0], p[1], tool[1], behind(number));
      return t.reach == Reach::kOk
                 ? place(held(t, hint), hand, t.radius_m - tool[0] * hand.cosine + tool[2] * hand.sine,
                         p[2] - tool[0] * hand.sine - tool[2] * hand.cosine, number, hint)
                 : refused(t, tool[1]);
    }
    hand.roll_rad = angles[1];
    const Vector3 off = off_roll_axis(tool, hand);
    const Turn t = turn(p[0], p[1], lateral_m + off[1], behind(number));
    if (t.reach != Reach::kOk) return refused(t, lateral_m + off[1]);
    return place_hand(held(t, hint), hand, t.radius_m - off[0], p[2] - off[2], number, hint);
  }

 private:
  [[nodiscard]] static bool behind(std::uint32_t number) noexcept { return (number & 2u) != 0; }
  /// Takes the hint's angle on the axis itself, if no orientation gives one.
  [[nodiscard]] static Turn held(Turn t, const Joints& hint) noexcept {
    if (t.free) t.angle_rad = hint[0];
    return t;
  }
  /// Returns the tool's distance from the roll axis.
  [[nodiscard]] double tool_off_m() const noexcept {
    return root_sum(mount.hand.position_m[1], mount.hand.position_m[2]);
  }
  /// Returns C at the hint.
  [[nodiscard]] double pitch_at(const Joints& q) const noexcept {
    return links.sign2 * q[1] + links.sign3 * q[2] + links.sign4 * q[3] + hand_zero_rad;
  }

  /// Returns joints for a wrist axis this far ahead of axis 1 and above the shoulder.
  [[nodiscard]] IkSolution place(const Turn& t, const PlanarHand& hand, double ahead_m, double above_m,
                                 std::uint32_t number, const Joints& hint) const noexcept {
    IkSolution solution;
    double forearm = 0.0;
    if (!links.bend(ahead_m - links.shoulder_m, above_m, t.slack_m, links.fore_m, links.fore_zero_rad, number,
                    hint, solution, forearm)) {
      return solution;
    }
    solution.orientation_error_rad = hand.error_rad;
    solution.joints_q[0] = nearest_turn(t.angle_rad, hint[0]);
    solution.joints_q[3] =
        nearest_turn(links.sign4 * (hand.pitch_rad - hand_zero_rad - forearm + links.fore_zero_rad), hint[3]);
    return solution;
  }
  /// Does the same with a roll, from the tool's foot on the roll axis.
  [[nodiscard]] IkSolution place_hand(const Turn& t, const PlanarHand& hand, double ahead_m, double above_m,
                                      std::uint32_t number, const Joints& hint) const noexcept {
    const double length_m = mount.hand.position_m[0];
    IkSolution solution = place(t, hand, ahead_m - length_m * hand.cosine + raise_m * hand.sine,
                                above_m - length_m * hand.sine - raise_m * hand.cosine, number, hint);
    if (solution.status == IkStatus::kOk) solution.joints_q[4] = nearest_turn(hand.roll_rad, hint[4]);
    return solution;
  }

  [[nodiscard]] IkSolution without_wrist(const Vector3& p, std::uint32_t number,
                                         const Joints& hint) const noexcept {
    const Vector3& tool = mount.hand.position_m;
    const Turn t = turn(p[0], p[1], tool[1], behind(number));
    if (t.reach != Reach::kOk) return refused(t, tool[1]);
    IkSolution solution;
    double forearm = 0.0;
    if (links.bend(t.radius_m - links.shoulder_m, p[2], t.slack_m, root_sum(tool[0], tool[2]),
                   std::atan2(tool[2], tool[0]), number, hint, solution, forearm)) {
      solution.joints_q[0] = t.free ? hint[0] : nearest_turn(t.angle_rad, hint[0]);
    }
    return solution;
  }

  [[nodiscard]] IkSolution with_wrist(const Pose& p, std::uint32_t number,
                                      const Joints& hint) const noexcept {
    const Vector3& tool = mount.hand.position_m;
    Turn t = turn(p.position_m[0], p.position_m[1], tool[1], behind(number));
    if (t.reach != Reach::kOk) return refused(t, tool[1]);
    const Quaternion g = p.orientation * mount.unhand;
    if (std::abs(t.radius_m) <= kNearAxis_m) {  // the heading is that of the plane's normal, a quarter back
      turn_beside_axis(t, p.position_m, tool[1], 1.0 - 2.0 * (g.x * g.x + g.z * g.z),
                       2.0 * (g.w * g.z - g.x * g.y), behind(number), hint[0]);
    }
    const PlanarHand hand = nearest_pitch(mount, t, g, p.orientation, pitch_at(hint));
    return place(t, hand, t.radius_m - tool[0] * hand.cosine + tool[2] * hand.sine,
                 p.position_m[2] - tool[0] * hand.sine - tool[2] * hand.cosine, number, hint);
  }

  /// Beside axis 1 tool and hand may be on different sides of it. The number follows the tool, as along a
  /// path.
  [[nodiscard]] IkSolution with_roll(const Pose& p, std::uint32_t number, const Joints& hint) const noexcept {
    const Facing own = facing(p, behind(number), number, hint);
    const double beside_m = 3.0 * tool_off_m() + std::abs(lateral_m);
    if (root_sum(p.position_m[0], p.position_m[1]) > beside_m) return own.solution;
    return nearer(own, facing(p, !behind(number), number, hint), behind(number));
  }
  /// Iterates, since with a tool off the roll axis the plane depends on the hand, and the hand on the plane.
  /// Each step gains the factor tool offset / radius.
  [[nodiscard]] Facing facing(const Pose& p, bool hand_behind, std::uint32_t number,
                              const Joints& hint) const noexcept {
    const Vector3& tool = mount.hand.position_m;
    const double off_m = tool_off_m();
    const Quaternion g = p.orientation * mount.unhand;
    Vector3 foot = p.position_m - rotate(g, {0.0, tool[1], tool[2]});  // the tool's foot on the roll axis
    for (int step = 0; step < kMostSteps; ++step) {
      Turn t = turn(foot[0], foot[1], lateral_m, hand_behind);
      if (t.reach != Reach::kOk) return {refused(t, lateral_m), Facing::kNoPlane_rad};
      if (std::abs(t.radius_m) <= kNearAxis_m) {
        turn_beside_axis(t, foot, lateral_m, 1.0 - 2.0 * (g.y * g.y + g.z * g.z),
                         2.0 * (g.x * g.y + g.w * g.z), hand_behind, hint[0]);
      }
      const PlanarHand hand = nearest_pitch_and_roll(t, g, pitch_at(hint));
      double moved_m = hand.error_rad * off_m;
      const Vector3 off = off_m > 0.0 ? off_roll_axis(tool, hand) : Vector3{};
      if (moved_m > kConverged_m) {
        const Vector3 next = p.position_m - Vector3{t.cosine * off[0] - t.sine * off[1],
                                                    t.sine * off[0] + t.cosine * off[1], off[2]};
        moved_m = norm(next - foot);
        foot = next;
      }
      if (moved_m <= kConverged_m) {
        return {place_hand(t, hand, t.radius_m, foot[2], number, hint), hand.error_rad, t.radius_m + off[0]};
      }
    }
    return {{IkStatus::kTooClose, {}, 0.0, root_sum(foot[0], foot[1]), off_m}, Facing::kNoPlane_rad};
  }
};

}  // namespace corbot
