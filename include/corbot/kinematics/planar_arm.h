// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <numbers>
#include <optional>

#include "corbot/kinematics/closed_form.h"
#include "corbot/kinematics/planar_links.h"

namespace corbot {

/// A base that turns about an axis, then two or three parallel axes square to it (shoulder, elbow, wrist), then perhaps a roll
/// square to those: three to five joints. Hobby arms, the Lynx 5. Siciliano et al., Robotics, 2009, chapter 2.
///
/// Own frame: z along axis 1, origin at the shoulder's height, x ahead of the axis where the tool is at zero. Inclinations are
/// counted from x towards z: A of the upper arm, B of the forearm, C of the hand. The last frame has its origin on the wrist
/// axis (or at the roll axis' foot beside it), x along the hand; the tool may be anywhere in it.
///
/// Solutions: bit 0: joint 3 is bent to its negative side (from straight). Bit 1: the base faces away from the point.
struct PlanarArm {
  static constexpr const char* kName = "base and planar arm";

  Mounting mount{};
  std::uint32_t count{};  ///< joints: 3 (no wrist), 4, or 5 (with roll)
  PlanarLinks links{};
  double hand_zero_rad{};  ///< C at zero
  double lateral_m{};  ///< of the roll axis from axis 1's plane; without roll the tool's own lateral counts
  double raise_m{};    ///< of the roll axis above the wrist axis, square to both

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
      const Vector3 roll = rotate(conjugate(links->second.orientation), chain.axes[4].direction);
      if (!square(roll, {0.0, 1.0, 0.0})) return std::nullopt;
      const Vector3 point =
          rotate(conjugate(links->second.orientation), chain.axes[4].point_m - links->second.position_m);
      arm.hand_zero_rad = std::atan2(roll[2], roll[0]);
      arm.lateral_m = point[1];
      last.orientation = about({0.0, -1.0, 0.0}, arm.hand_zero_rad);
      const Vector3 up = rotate(last.orientation, {0.0, 0.0, 1.0});
      arm.raise_m = dot(point - last.position_m, up);
      last.position_m = last.position_m + Vector3{0.0, arm.lateral_m, 0.0} + arm.raise_m * up;
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
    const double bent = links.sign2 * q[1] + links.sign3 * q[2];
    const double hand = count > 3 ? bent + links.sign4 * q[3] + hand_zero_rad : bent;
    double r = links.shoulder_m + links.upper_m * std::cos(a);
    double z = links.upper_m * std::sin(a);
    if (count > 3) {
      r += links.fore_m * std::cos(bent + links.fore_zero_rad);
      z += links.fore_m * std::sin(bent + links.fore_zero_rad);
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
    if (!is_finite(pose) || !std::isfinite(hint[0] + hint[1] + hint[2] + hint[3] + hint[4])) return {};
    const Pose p = mount.to_family(pose);
    if (count == 5) return with_roll(p, number, hint);
    return count == 4 ? with_wrist(p, number, hint) : without_wrist(p, pose, number, hint);
  }

 private:
  /// Angle of the hand about its own plane's normal at the hint.
  [[nodiscard]] double hand_at(const Joints& q) const noexcept {
    return links.sign2 * q[1] + links.sign3 * q[2] + links.sign4 * q[3] + hand_zero_rad;
  }
  [[nodiscard]] static bool behind(std::uint32_t number) noexcept { return (number & 2u) != 0; }

  [[nodiscard]] IkSolution without_wrist(const Pose& p, const Pose& pose, std::uint32_t number,
                                         const Joints& hint) const noexcept {
    const Vector3& tool = mount.hand.position_m;
    const Turn t = turn(p.position_m[0], p.position_m[1], tool[1], behind(number));
    if (t.reach != Reach::kOk) return refused(t, tool[1]);
    IkSolution solution;
    double forearm = 0.0;
    if (!links.bend(t.radius_m - links.shoulder_m, p.position_m[2], t.slack_m, root_sum(tool[0], tool[2]),
                    std::atan2(tool[2], tool[0]), number, hint, solution, forearm)) {
      return solution;
    }
    solution.joints_q[0] = t.free ? hint[0] : nearest_turn(t.angle_rad, hint[0]);
    solution.orientation_error_rad = angle_between(forward(solution.joints_q).orientation, pose.orientation);
    return solution;
  }

  /// Four joints: of Rz(−θ)·R that rotation about the plane's normal which is nearest (twist), the rest (swing) is the error.
  [[nodiscard]] IkSolution with_wrist(const Pose& p, std::uint32_t number,
                                      const Joints& hint) const noexcept {
    const Vector3& tool = mount.hand.position_m;
    Turn t = turn(p.position_m[0], p.position_m[1], tool[1], behind(number));
    if (t.reach != Reach::kOk) return refused(t, tool[1]);
    const Quaternion g = p.orientation * mount.unhand;
    if (std::abs(t.radius_m) <= kNearAxis_m) {  // the heading is that of the plane's normal, a quarter back
      const double nx = 2.0 * (g.x * g.y - g.w * g.z);
      const double ny = 1.0 - 2.0 * (g.x * g.x + g.z * g.z);
      turn_beside_axis(t, p.position_m, tool[1], ny, -nx, behind(number), hint[0]);
    }
    const auto [ct, st] = half_angle(t.cosine, t.sine);
    const Quaternion rel{ct * g.w + st * g.z, ct * g.x + st * g.y, ct * g.y - st * g.x, ct * g.z - st * g.w};
    const double along = rel.w * rel.w + rel.y * rel.y;
    IkSolution solution;
    double hand = 0.0, ch = 1.0, sh = 0.0;
    if (along <=
        kTied * kTied) {  // upside down: every inclination is 180 degrees off; the tool's x axis decides
      const Vector3 now = rotate(p.orientation, {1.0, 0.0, 0.0});
      const Vector3 own = rotate(mount.hand.orientation, {1.0, 0.0, 0.0});
      const double ahead = now[0] * t.cosine + now[1] * t.sine;
      const bool lateral = root_sum(own[0], own[2]) < kTied || root_sum(ahead, now[2]) < kTied;
      hand = lateral ? hand_at(hint) : std::atan2(now[2], ahead) - std::atan2(own[2], own[0]);
      ch = std::cos(hand);
      sh = std::sin(hand);
      const double same = std::cos(0.5 * hand) * rel.w - std::sin(0.5 * hand) * rel.y;
      solution.orientation_error_rad = 2.0 * std::atan2(1.0, std::abs(same));
    } else {
      hand = -2.0 * std::atan2(rel.y, rel.w);
      ch = (rel.w - rel.y) * (rel.w + rel.y) / along;
      sh = -2.0 * rel.w * rel.y / along;
      solution.orientation_error_rad = double_angle(root_sum(rel.x, rel.z), std::sqrt(along));
    }
    double forearm = 0.0;
    if (!links.bend(t.radius_m - links.shoulder_m - tool[0] * ch + tool[2] * sh,
                    p.position_m[2] - tool[0] * sh - tool[2] * ch, t.slack_m, links.fore_m,
                    links.fore_zero_rad, number, hint, solution, forearm)) {
      return solution;
    }
    solution.joints_q[0] = nearest_turn(t.angle_rad, hint[0]);
    solution.joints_q[3] =
        nearest_turn(links.sign4 * (hand - hand_zero_rad - forearm + links.fore_zero_rad), hint[3]);
    return solution;
  }

  /// Five joints: the hand's axis a is brought into the arm's plane by the shortest rotation, the roll is what remains. Where
  /// the tool is off the roll axis the plane depends on that, by tool offset / radius a step: iterated.
  [[nodiscard]] IkSolution with_roll(const Pose& p, std::uint32_t number, const Joints& hint) const noexcept {
    const Vector3& tool = mount.hand.position_m;
    const double off_m = root_sum(tool[1], tool[2]);
    const Quaternion g = p.orientation * mount.unhand;
    Vector3 foot = p.position_m - rotate(g, {0.0, tool[1], tool[2]});  // of the tool on the roll axis
    for (int step = 0; step < kMostSteps; ++step) {
      Turn t = turn(foot[0], foot[1], lateral_m, behind(number));
      if (t.reach != Reach::kOk) return refused(t, lateral_m);
      if (std::abs(t.radius_m) <= kNearAxis_m) {
        const double ax = 1.0 - 2.0 * (g.y * g.y + g.z * g.z);
        const double ay = 2.0 * (g.x * g.y + g.w * g.z);
        turn_beside_axis(t, foot, lateral_m, ax, ay, behind(number), hint[0]);
      }
      const auto [ct, st] = half_angle(t.cosine, t.sine);
      const Quaternion rel{ct * g.w + st * g.z, ct * g.x + st * g.y, ct * g.y - st * g.x,
                           ct * g.z - st * g.w};
      const double ax = 1.0 - 2.0 * (rel.y * rel.y + rel.z * rel.z);
      const double ay = 2.0 * (rel.x * rel.y + rel.w * rel.z);
      const double az = 2.0 * (rel.x * rel.z - rel.w * rel.y);
      const double in_plane = root_sum(ax, az);
      const double hand = in_plane < kTied ? hand_at(hint) : std::atan2(az, ax);
      const double ch = in_plane < kTied ? std::cos(hand) : ax / in_plane;
      const double sh = in_plane < kTied ? std::sin(hand) : az / in_plane;
      const auto [c2, s2] = half_angle(ch, sh);
      const double roll = 2.0 * std::atan2(c2 * rel.x + s2 * rel.z, c2 * rel.w - s2 * rel.y);
      IkSolution solution;
      solution.orientation_error_rad = 0.5 * double_angle(std::abs(ay), in_plane);
      double moved_m = solution.orientation_error_rad * off_m;
      if (moved_m > kConverged_m) {
        const double ty = tool[1] * std::cos(roll) - tool[2] * std::sin(roll);
        const double tz = tool[1] * std::sin(roll) + tool[2] * std::cos(roll);
        const Vector3 next = p.position_m - Vector3{-t.cosine * tz * sh - t.sine * ty,
                                                    -t.sine * tz * sh + t.cosine * ty, tz * ch};
        moved_m = norm(next - foot);
        foot = next;
      }
      if (moved_m > kConverged_m) continue;
      double forearm = 0.0;
      if (!links.bend(t.radius_m - links.shoulder_m - tool[0] * ch + raise_m * sh,
                      foot[2] - tool[0] * sh - raise_m * ch, t.slack_m, links.fore_m, links.fore_zero_rad,
                      number, hint, solution, forearm)) {
        return solution;
      }
      solution.joints_q[0] = nearest_turn(t.angle_rad, hint[0]);
      solution.joints_q[3] =
          nearest_turn(links.sign4 * (hand - hand_zero_rad - forearm + links.fore_zero_rad), hint[3]);
      solution.joints_q[4] = nearest_turn(roll, hint[4]);
      return solution;
    }
    return {IkStatus::kTooClose, {}, 0.0, root_sum(foot[0], foot[1]), off_m};
  }

  /// The base's turn for a point next to axis 1: to the heading (x, y) that the orientation has, if the point fits, either way round;
  /// on the axis itself the hint's if that heading is none.
  static void turn_beside_axis(Turn& t, const Vector3& point, double b, double x, double y, bool behind,
                               double hint_rad) noexcept {
    const bool upright = root_sum(x, y) < kTied;
    const double heading = upright ? hint_rad : std::atan2(y, x);
    if (t.free) {
      t.angle_rad = behind && !upright ? heading + std::numbers::pi : heading;
      t.cosine = std::cos(t.angle_rad);
      t.sine = std::sin(t.angle_rad);
    } else if (!upright && !take_heading(t, point[0], point[1], b, behind, heading)) {
      (void)take_heading(t, point[0], point[1], b, behind, heading + std::numbers::pi);
    }
  }

  static constexpr double kTied = 1e-9;  ///< a direction that is shorter is none
  static constexpr double kConverged_m = 1e-15;
  static constexpr int kMostSteps = 40;
};

}  // namespace corbot
