// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <utility>

#include "corbot/kinematics/arm_kinematics.h"

// Bounds of the joints' motion along a stretch of path. They hold for every point of it, for every family, by
// one theorem.
//
// Along a path x(s) the joints obey M(q)·q′ = x′. M is the Jacobian of the tool's position and, below it,
// that of its orientation or the rows of the angles that the arm follows. Let q0 solve the middle of a cell
// of half width w, and A = M(q0)⁻¹. For every q of the box `|q − q0| ≤ w·y` let `|A·(M(q) − M(q0))| ≤ E` and
// `|A·x′| ≤ u` on the cell, entry by entry. If `u + E·y ≤ y`, then two statements hold:
// * M is invertible on the box: the matrix E maps a positive vector below itself, so it has no eigenvalue of
//   1 or more.
// * There `|q′| ≤ y`, because `|q′| ≤ u + E·|q′|`, whose greatest solution is `(I − E)⁻¹·u ≤ y`.
// So the joints cannot leave the box before the cell ends. They exist on the whole cell, on the solution of
// the middle and no other, with `|q′| ≤ y` and `|q − q0| ≤ w·y`. Nothing else is needed: a proved cell is
// within reach and without a singularity. Rounding is not directed: it is fourteen digits down.
//
// Real-time safe, though only the planner's proof and the gate's proof need it.

namespace corbot {

/// The rate that a path needs, per unit of its parameter: first the velocity of the tool's position (m). Then
/// follows the angular velocity in the base frame (rad) for arms that follow every orientation, else the
/// rates of the followed angles (rad).
using TaskRate = std::array<double, 6>;

struct StretchBound {
  /// All else is meaningful only if so. If not, the middle's rates are, unless they are infinite.
  bool is_proved{};
  Joints rate_middle{};  ///< q′ in the middle, with its sign
  Joints rate_bound{};   ///< of |q′| on the cell
  Joints stray_q{};      ///< of |q − q0| on the cell: half width times the rate's bound
};

namespace detail {

using Matrix6 = std::array<std::array<double, kMaxJoints>, 6>;

/// Inverts by elimination with partial pivots; false if there is no inverse.
[[nodiscard]] inline bool invert(std::size_t n, Matrix6 m, Matrix6& inverse) noexcept {
  inverse = {};
  for (std::size_t i = 0; i < n; ++i) inverse[i][i] = 1.0;
  for (std::size_t column = 0; column < n; ++column) {
    std::size_t pivot = column;
    for (std::size_t i = column + 1; i < n; ++i) {
      if (std::abs(m[i][column]) > std::abs(m[pivot][column])) pivot = i;
    }
    if (!(std::abs(m[pivot][column]) > 1e-14)) return false;
    std::swap(m[pivot], m[column]);
    std::swap(inverse[pivot], inverse[column]);
    const double k = 1.0 / m[column][column];
    for (std::size_t j = 0; j < n; ++j) {
      m[column][j] *= k;
      inverse[column][j] *= k;
    }
    for (std::size_t i = 0; i < n; ++i) {
      if (i == column) continue;
      const double f = m[i][column];
      for (std::size_t j = 0; j < n; ++j) {
        m[i][j] -= f * m[column][j];
        inverse[i][j] -= f * inverse[column][j];
      }
    }
  }
  return true;
}

}  // namespace detail

/// M of this file's head, and the number of its rows; it has one column for each joint.
struct TaskMatrix {
  detail::Matrix6 m{};
  std::size_t rows{};
};
[[nodiscard]] inline TaskMatrix task_matrix(const Kinematics& arm, const Joints& q) noexcept {
  TaskMatrix task{arm.jacobian(q), 6};
  if (arm.follows() == Follows::kFull) return task;
  const FollowedAngles followed = arm.followed();
  for (std::size_t k = 0; k < followed.count; ++k) task.m[3 + k] = followed.rows[k];
  task.rows = 3 + followed.count;
  return task;
}

/// Returns the least pivot of M in magnitude, by elimination with partial pivots. It is 0 at a singularity,
/// and if M is not square. Its unit is the task's (m, rad) per unit of a joint.
[[nodiscard]] inline double least_pivot(const Kinematics& arm, const Joints& q) noexcept {
  TaskMatrix task = task_matrix(arm, q);
  const std::size_t n = arm.joint_count();
  if (task.rows != n) return 0.0;
  double least = std::numeric_limits<double>::infinity();
  for (std::size_t column = 0; column < n; ++column) {
    std::size_t pivot = column;
    for (std::size_t i = column + 1; i < n; ++i) {
      if (std::abs(task.m[i][column]) > std::abs(task.m[pivot][column])) pivot = i;
    }
    std::swap(task.m[pivot], task.m[column]);
    const double divisor = task.m[column][column];
    least = std::min(least, std::abs(divisor));
    if (divisor == 0.0) return 0.0;
    for (std::size_t i = column + 1; i < n; ++i) {
      const double f = task.m[i][column] / divisor;
      for (std::size_t j = column + 1; j < n; ++j) task.m[i][j] -= f * task.m[column][j];
    }
  }
  return least;
}

/// The theorem's numbers at one configuration.
class PathForm {
 public:
  static constexpr std::size_t kNoJoint = kMaxJoints;

  /// `q0`: joints in the middle of the cell. `held`: one of the arm's joints that does not move, because it
  /// is free along a singularity. Then one entry of the task's rate is left over, and solve() returns it in
  /// this joint's place. It is 0 if the other joints follow the path alone.
  PathForm(const Kinematics& arm, const Joints& q0, std::size_t held = kNoJoint) noexcept
      : count_(arm.joint_count()), held_(held), turns_full_(arm.follows() == Follows::kFull) {
    const auto [task, rows] = task_matrix(arm, q0);
    if (rows == count_) invert(task);
    for (std::size_t i = 0; i < count_; ++i) {
      rotary_[i] = arm.joint_kind(i) == JointKind::kRotary;
      lever_[i] = norm({task[0][i], task[1][i], task[2][i]});
      part_[i] = norm({inverse_[i][0], inverse_[i][1], inverse_[i][2]});
      angular_part_[i] = norm({inverse_[i][3], inverse_[i][4], inverse_[i][5]});
    }
  }

  /// False at a singularity, and for arms of fewer than six joints that no family has recognised.
  [[nodiscard]] bool is_regular() const noexcept { return is_regular_; }
  /// The joint that does not move; kNoJoint if all may.
  [[nodiscard]] std::size_t held() const noexcept { return held_; }

  /// Returns M⁻¹·rate, for a regular form.
  [[nodiscard]] Joints solve(const TaskRate& rate) const noexcept {
    Joints q{};
    for (std::size_t i = 0; i < count_; ++i) {
      for (std::size_t k = 0; k < count_; ++k) q[i] += inverse_[i][k] * rate[k];
    }
    return q;
  }
  /// Returns the entry of M⁻¹ with the greatest magnitude (rad or m of a joint, per unit of the task). It
  /// measures the nearness of a singularity.
  [[nodiscard]] double greatest_inverse() const noexcept { return greatest(inverse_); }

  /// `rate`: the task's rate in the middle. `rate_stray`: the deviation of each entry on the cell.
  /// `half_width`: of the cell.
  [[nodiscard]] StretchBound bound(const TaskRate& rate, const TaskRate& rate_stray,
                                   double half_width) const noexcept {
    StretchBound b;
    if (!is_regular_) return b;
    Joints u{};
    for (std::size_t i = 0; i < count_; ++i) {
      double stray = 0.0;
      for (std::size_t k = 0; k < count_; ++k) {
        b.rate_middle[i] += inverse_[i][k] * rate[k];
        stray += std::abs(inverse_[i][k]) * rate_stray[k];
      }
      u[i] = std::abs(b.rate_middle[i]) + stray;
    }
    Joints y = u;
    for (int step = 0; step < kSteps; ++step)
      y = image(u, y, half_width);  // from below, towards the least solution
    for (std::size_t i = 0; i < count_; ++i) y[i] = (y[i] + kWidened * (y[i] - u[i])) * (1.0 + kRounded);
    const Joints z = image(u, y, half_width);
    b.is_proved = true;
    for (std::size_t i = 0; i < count_; ++i) {
      b.is_proved = b.is_proved && z[i] <= y[i] && std::isfinite(y[i]);
      b.rate_bound[i] = y[i];
      b.stray_q[i] = half_width * y[i];
    }
    return b;
  }

 private:
  static constexpr int kSteps = 12;
  /// Widens the part that E adds, so that the image stays inside although E grows with the box.
  static constexpr double kWidened = 1e-5;
  static constexpr double kRounded = 1e-12;

  static double greatest(const detail::Matrix6& m) noexcept {
    double greatest = 0.0;
    for (const auto& row : m) {
      for (const double entry : row) greatest = std::max(greatest, std::abs(entry));
    }
    return greatest;
  }

  /// Replaces the held joint's column by the unit vector that leaves M the farthest from a singularity.
  void invert(const detail::Matrix6& task) noexcept {
    if (held_ == kNoJoint) {
      is_regular_ = detail::invert(count_, task, inverse_);
      return;
    }
    for (std::size_t row = 0; row < count_; ++row) {
      detail::Matrix6 m = task, inverse{};
      for (std::size_t k = 0; k < count_; ++k) m[k][held_] = k == row ? 1.0 : 0.0;
      if (!detail::invert(count_, m, inverse)) continue;
      if (!is_regular_ || greatest(inverse) < greatest_inverse()) inverse_ = inverse;
      is_regular_ = true;
    }
  }

  /// Returns u + E·y for the box w·y. Columns Jn of position are derivatives of one function. So for either
  /// order of two joints m ≤ n, |∂Jn/∂qm| = |∂Jm/∂qn| = |zm × Jn| ≤ |Jn| if joint m turns, else 0. The
  /// angular columns, zj, change by at most the turns before them. A row of A takes from a column's change at
  /// most the length of its part times the length of the change.
  [[nodiscard]] Joints image(const Joints& u, const Joints& y, double half_width) const noexcept {
    // Jn| on the box, from the tool inwards: joints up to n only turn Jn, and joints after n lengthen it. A
    // slide's is a unit vector.
    Joints lever = lever_;
    for (std::size_t n = count_; n-- > 0;) {
      for (std::size_t m = n + 1; rotary_[n] && m < count_; ++m) lever[n] += lever[m] * half_width * y[m];
    }
    Joints z = u;
    for (std::size_t j = 0; j < count_; ++j) {
      double moved_m = 0.0, turned = 0.0;  // lengths of the changes of column j
      for (std::size_t k = 0; k < count_; ++k) {
        const double r = half_width * y[k];
        if (rotary_[std::min(j, k)]) moved_m += lever[std::max(j, k)] * r;
        if (k < j && rotary_[j] && rotary_[k]) turned += r;
      }
      for (std::size_t i = 0; i < count_; ++i) {
        z[i] += (part_[i] * moved_m + (turns_full_ ? angular_part_[i] * turned : 0.0)) * y[j];
      }
    }
    return z;
  }
  std::size_t count_, held_;
  bool turns_full_;
  bool is_regular_{};
  std::array<bool, kMaxJoints> rotary_{};
  Joints lever_{};  ///< |Jn|: distance of the tool from a turning axis, 1 for a slide
  detail::Matrix6 inverse_{};
  Joints part_{}, angular_part_{};  ///< lengths of A's rows within the columns of position, of orientation
};

}  // namespace corbot
