// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <type_traits>
#include <utility>
#include <variant>

#include "corbot/kinematics/closed_form.h"
#include "corbot/kinematics/cylindrical_arm.h"
#include "corbot/kinematics/gantry_arm.h"
#include "corbot/kinematics/gantry_wrist_arm.h"
#include "corbot/kinematics/ortho_parallel_arm.h"
#include "corbot/kinematics/other_arm.h"
#include "corbot/kinematics/parallel_axes_arm.h"
#include "corbot/kinematics/planar_arm.h"
#include "corbot/kinematics/polar_arm.h"
#include "corbot/kinematics/scara_arm.h"

namespace corbot {

/// The families, one line each, in the order of recognition; the last one takes every arm.
using Families = std::variant<  //
    PlanarArm,                  //
    ScaraArm,                   //
    GantryArm,                  //
    GantryWristArm,             //
    CylindricalArm,             //
    PolarArm,                   //
    OrthoParallelArm,           //
    ParallelAxesArm,            //
    OtherArm>;

/// One of the solutions at a pose.
struct NumberedSolution {
  std::uint32_t number{};
  IkSolution solution{};
};

/// All solutions at a pose, in the order of their numbers. If two numbers have the same joints (a stretched
/// arm), the smaller number stands for both.
struct SolutionSet {
  std::uint32_t count{};
  std::array<NumberedSolution, kMaxSolutions> entries{};
  /// The first refusal: why there is no solution, or fewer than usual.
  IkSolution refusal{};

  [[nodiscard]] const NumberedSolution* begin() const noexcept { return entries.data(); }
  [[nodiscard]] const NumberedSolution* end() const noexcept { return entries.data() + count; }
};

/// An arm's kinematics, of any family: a value, trivially copyable, no heap, nothing throws. All of it is
/// real-time safe. Poses are base_T_tool; joints are as in the table (rad, m). The caller checks the joint
/// limits.
class Kinematics {
 public:
  Kinematics() noexcept : form_(OtherArm{}) {}

  /// Returns f(family), with the family's type known to the compiler.
  template <class F>
  [[nodiscard]] decltype(auto) visit(F&& f) const noexcept {
    return std::visit(std::forward<F>(f), form_);
  }

  /// Returns the first family that recognises the axes. The caller must first snap inexact tables (1.5708 for
  /// a right angle).
  [[nodiscard]] static Kinematics recognise(const JointChain& chain) noexcept {
    Kinematics kinematics;
    kinematics.chain_ = chain;
    choose(kinematics.form_, chain, std::make_index_sequence<std::variant_size_v<Families>>{});
    return kinematics;
  }

  /// Returns numerically solved kinematics, even if a family would take the axes.
  [[nodiscard]] static Kinematics other(const JointChain& chain) noexcept {
    Kinematics kinematics;
    kinematics.chain_ = chain;
    kinematics.form_ = OtherArm{chain};
    return kinematics;
  }

  [[nodiscard]] const JointChain& chain() const noexcept { return chain_; }
  [[nodiscard]] const Families& form() const noexcept { return form_; }
  [[nodiscard]] const char* family() const noexcept {
    return visit([](const auto& form) { return std::remove_cvref_t<decltype(form)>::kName; });
  }
  [[nodiscard]] std::uint32_t joint_count() const noexcept { return chain_.count; }
  [[nodiscard]] JointKind joint_kind(std::size_t joint) const noexcept { return chain_.axes[joint].kind; }
  [[nodiscard]] Follows follows() const noexcept {
    return visit([](const auto& form) { return form.follows(); });
  }
  /// Returns the number of solutions, numbered 0 … count − 1; 0 if there is no closed form.
  [[nodiscard]] std::uint32_t solution_count() const noexcept {
    return visit([](const auto& form) { return form.solution_count(); });
  }
  [[nodiscard]] bool has_closed_form() const noexcept { return solution_count() > 0; }
  [[nodiscard]] bool has_solution(std::uint32_t number) const noexcept { return number < solution_count(); }

  /// Moves the arm to another place, or gives it another tool.
  void set_frames(const Pose& base_T_0, const Pose& n_T_tool) noexcept {
    chain_.base_T_0 = base_T_0;
    chain_.n_T_tool = n_T_tool;
    std::visit([&](auto& form) { form.set_frames(base_T_0, n_T_tool); }, form_);
  }

  [[nodiscard]] Pose forward(const Joints& q) const noexcept {
    return visit([&q](const auto& form) { return form.forward(q); });
  }
  [[nodiscard]] IkSolution inverse(const Pose& pose, std::uint32_t number,
                                   const Joints& hint) const noexcept {
    return visit([&](const auto& form) { return form.inverse(pose, number, hint); });
  }
  /// Returns the angles that an arm of fewer than six joints follows of an orientation, as sums of joints. A
  /// path keeps or interpolates these angles. An orientation between two that the arm can take is mostly not
  /// reachable.
  [[nodiscard]] FollowedAngles followed() const noexcept {
    return visit([](const auto& form) -> FollowedAngles {
      if constexpr (FollowsAngles<std::remove_cvref_t<decltype(form)>>) return form.followed();
      return {};
    });
  }
  /// Returns joints for a position and these angles; kNoSolution for an arm that follows every orientation.
  [[nodiscard]] IkSolution inverse_at(const Vector3& position_m, const Angles& angles, std::uint32_t number,
                                      const Joints& hint) const noexcept {
    return visit([&](const auto& form) -> IkSolution {
      if constexpr (FollowsAngles<std::remove_cvref_t<decltype(form)>>) {
        return form.inverse_at(position_m, angles, number, hint);
      }
      return {IkStatus::kNoSolution};
    });
  }
  [[nodiscard]] Jacobian jacobian(const Joints& q) const noexcept { return corbot::jacobian(chain_, q); }

  /// Returns all solutions with an orientation error of at most the limit.
  [[nodiscard]] SolutionSet solutions(const Pose& pose, const Joints& hint,
                                      double orientation_limit_rad) const noexcept {
    return visit([&](const auto& form) {
      using Form = std::remove_cvref_t<decltype(form)>;
      SolutionSet set;
      bool refused_one = false;
      const auto add = [&](std::uint32_t number, const IkSolution& solution) {
        if (solution.status != IkStatus::kOk) {
          if (!refused_one) set.refusal = solution;
          refused_one = true;
        } else if (solution.orientation_error_rad <= orientation_limit_rad &&
                   !contains(set, solution.joints_q)) {
          set.entries[set.count++] = {number, solution};
        }
      };
      const std::uint32_t numbers = form.solution_count();
      if constexpr (SolvesAll<Form>) {
        std::array<IkSolution, Form::kSolutions> all;
        form.inverse_all(pose, hint, all);
        for (std::uint32_t number = 0; number < numbers; ++number) add(number, all[number]);
      } else {
        for (std::uint32_t number = 0; number < numbers; ++number)
          add(number, form.inverse(pose, number, hint));
      }
      return set;
    });
  }

  /// Returns the solution on which these joints lie, the smallest number if they are common to several;
  /// nullopt if there is no closed form. A round trip finds it. Next to a stretched arm half of the digits
  /// are lost, so joints count as the same within 2e-7.
  [[nodiscard]] std::optional<std::uint32_t> solution_of(const Joints& q) const noexcept {
    return visit([&](const auto& form) -> std::optional<std::uint32_t> {
      const Pose pose = form.forward(q);
      const std::uint32_t numbers = form.solution_count();
      for (std::uint32_t number = 0; number < numbers; ++number) {
        const IkSolution solution = form.inverse(pose, number, q);
        if (solution.status == IkStatus::kOk && same(solution.joints_q, q, kSameJoints_q)) return number;
      }
      return std::nullopt;
    });
  }

  /// Returns the same joints, with every rotary joint at its turn within the limits nearest to the hint.
  /// Returns nullopt if a joint has no such turn, or a slide is beyond its limits. A limit counts as kept if
  /// it is missed by the tolerance (rad or m).
  [[nodiscard]] std::optional<Joints> within(const Joints& lower_q, const Joints& upper_q, double tolerance_q,
                                             const Joints& q, const Joints& hint) const noexcept {
    Joints turned = q;
    for (std::size_t i = 0; i < chain_.count; ++i) {
      if (chain_.axes[i].kind == JointKind::kPrismatic) {
        if (q[i] < lower_q[i] - tolerance_q || q[i] > upper_q[i] + tolerance_q) return std::nullopt;
        continue;
      }
      const std::optional<double> turn = turn_within(q[i], lower_q[i], upper_q[i], tolerance_q, hint[i]);
      if (!turn) return std::nullopt;
      turned[i] = *turn;
    }
    return turned;
  }

  /// Tells whether two solutions are one. Both are nearest to one hint, so whole turns matter only at half a
  /// turn to either side of it.
  [[nodiscard]] bool same(const Joints& a, const Joints& b, double tolerance_q) const noexcept {
    for (std::size_t i = 0; i < chain_.count; ++i) {
      const double away = a[i] - b[i];
      const bool turns = chain_.axes[i].kind == JointKind::kRotary;
      if (std::abs(turns ? nearest_turn(away, 0.0) : away) > tolerance_q) return false;
    }
    return true;
  }
  /// Joints next to a border are uncertain by this much (rad or m).
  static constexpr double kSameJoints_q = 2e-7;

 private:
  template <std::size_t... I>
  static void choose(Families& form, const JointChain& chain, std::index_sequence<I...>) noexcept {
    static_assert((ClosedForm<std::variant_alternative_t<I, Families>> && ...));
    (void)(recognised<std::variant_alternative_t<I, Families>>(form, chain) || ...);
  }
  template <class Form>
  static bool recognised(Families& families, const JointChain& chain) noexcept {
    const std::optional<Form> form = Form::recognise(chain);
    if (form) families = *form;
    return form.has_value();
  }
  [[nodiscard]] bool contains(const SolutionSet& set, const Joints& q) const noexcept {
    for (const NumberedSolution& entry : set) {
      if (same(entry.solution.joints_q, q, 1e-12)) return true;
    }
    return false;
  }

  JointChain chain_{};
  Families form_;
};
static_assert(std::is_trivially_copyable_v<Kinematics>);

}  // namespace corbot
