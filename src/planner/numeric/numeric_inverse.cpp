// SPDX-License-Identifier: Apache-2.0
#include "planner/numeric/numeric_inverse.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <optional>
#include <random>

#include "corbot/kinematics/angles.h"

namespace corbot::numeric {
namespace {

constexpr int kMostSteps = 80;
// the error must halve within this number of steps, else the seed is dropped
constexpr int kWatchedSteps = 8;
constexpr double kFinal = 1e-14;      // no further step improves the error
constexpr double kLongestStep = 1.2;  // rad, or metres over the arm's length
constexpr double kDistinct = 1e-3;
constexpr double kAlike = 1e-6;  // joint values that solutions have in common differ by less

using Vector6 = std::array<double, 6>;

/// The goal. Without angles it is the pose, or for up to three joints the position alone.
struct Wanted {
  Pose pose{};
  std::optional<FollowedAngles> followed{};
  Angles angles_rad{};
};

/// The error of the tool at some joints, and its derivative.
struct Linearised {
  Vector6 error{};  ///< position over the arm's length, then rotation vector (rad), both in the base frame
  Jacobian jacobian{};
  double error_m{}, error_rad{};
  double squared{};  ///< square of `error`
};

/// Returns the sum of the distances from axis to axis and to the tool.
double length_of(const JointChain& chain) noexcept {
  const Vector3 tool = (chain.zero_T_n * chain.n_T_tool).position_m;
  double length = 0.0;
  Vector3 last = tool;
  for (std::size_t i = chain.count; i-- > 0;) {
    if (chain.axes[i].kind != JointKind::kRotary) continue;
    const Vector3& direction = chain.axes[i].direction;
    const Vector3 away = last - chain.axes[i].point_m;
    last = chain.axes[i].point_m + dot(away, direction) * direction;
    length += norm(away - dot(away, direction) * direction);
  }
  return std::max(length, 1e-3);
}

/// Replaces the orientation's error by that of the followed angles, or by nothing.
void replace_orientation(const Wanted& wanted, const Joints& q, Linearised& at) noexcept {
  const FollowedAngles followed = wanted.followed.value_or(FollowedAngles{});
  const Angles there_rad = followed.at(q);
  at.error_rad = 0.0;
  for (std::size_t k = 0; k < 3; ++k) {
    at.error[3 + k] = k < followed.count ? wanted.angles_rad[k] - there_rad[k] : 0.0;
    at.jacobian[3 + k] = k < followed.count ? followed.rows[k] : Joints{};
    at.error_rad = std::max(at.error_rad, std::abs(at.error[3 + k]));
  }
}

Linearised linearise(const JointChain& chain, const Wanted& wanted, const Joints& q,
                     double length_m) noexcept {
  Linearised at;
  std::array<Vector3, kMaxJoints> direction{}, point{};
  Pose pose = chain.base_T_0;
  for (std::size_t i = 0; i < chain.count; ++i) {
    const JointAxis& axis = chain.axes[i];
    direction[i] = rotate(pose.orientation, axis.direction);
    point[i] = pose.position_m + rotate(pose.orientation, axis.point_m);
    pose = pose * displacement(axis, q[i]);
  }
  pose = pose * chain.zero_T_n * chain.n_T_tool;
  const double k = 1.0 / length_m;
  for (std::size_t i = 0; i < chain.count; ++i) {
    const bool turns = chain.axes[i].kind == JointKind::kRotary;
    const Vector3 linear = turns ? cross(direction[i], pose.position_m - point[i]) : direction[i];
    for (std::size_t n = 0; n < 3; ++n) {
      at.jacobian[n][i] = k * linear[n];
      at.jacobian[n + 3][i] = turns ? direction[i][n] : 0.0;
    }
  }
  const Vector3 away = wanted.pose.position_m - pose.position_m;
  const Quaternion d = wanted.pose.orientation * conjugate(pose.orientation);
  const double half_sine = std::sqrt(d.x * d.x + d.y * d.y + d.z * d.z);
  at.error_m = norm(away);
  at.error_rad = 2.0 * std::atan2(half_sine, std::abs(d.w));
  const double factor = std::copysign(half_sine > 1e-150 ? at.error_rad / half_sine : 2.0, d.w);
  at.error = {k * away[0], k * away[1], k * away[2], factor * d.x, factor * d.y, factor * d.z};
  if (wanted.followed || chain.count <= 3) replace_orientation(wanted, q, at);
  for (const double e : at.error) at.squared += e * e;
  return at;
}

/// Solves (JᵀJ + damping) step = Jᵀe by Cholesky. Returns false if the damping has not made the matrix
/// positive definite.
bool damped_step(const Linearised& at, std::size_t n, double damping, Vector6& step) noexcept {
  std::array<Vector6, 6> a{};
  for (std::size_t i = 0; i < n; ++i) {
    for (std::size_t k = 0; k <= i; ++k) {
      for (std::size_t m = 0; m < 6; ++m) a[i][k] += at.jacobian[m][i] * at.jacobian[m][k];
    }
    a[i][i] += damping;
    step[i] = 0.0;
    for (std::size_t m = 0; m < 6; ++m) step[i] += at.jacobian[m][i] * at.error[m];
  }
  for (std::size_t i = 0; i < n; ++i) {
    for (std::size_t k = 0; k <= i; ++k) {
      double sum = a[i][k];
      for (std::size_t m = 0; m < k; ++m) sum -= a[i][m] * a[k][m];
      if (i != k) {
        a[i][k] = sum / a[k][k];
      } else if (sum > 0.0) {
        a[i][i] = std::sqrt(sum);
      } else {
        return false;
      }
    }
    for (std::size_t m = 0; m < i; ++m) step[i] -= a[i][m] * step[m];
    step[i] /= a[i][i];
  }
  for (std::size_t i = n; i-- > 0;) {
    for (std::size_t m = i + 1; m < n; ++m) step[i] -= a[m][i] * step[m];
    step[i] /= a[i][i];
  }
  return true;
}

bool met(const Linearised& at) noexcept { return at.error_m < kSolved && at.error_rad < kSolved; }

bool refine(const JointChain& chain, const Wanted& wanted, double length_m, Joints& q,
            Linearised& at) noexcept {
  at = linearise(chain, wanted, q, length_m);
  double watched = at.squared;
  for (int step = 1; step <= kMostSteps && at.squared > kFinal * kFinal; ++step) {
    Vector6 move{};
    if (!damped_step(at, chain.count, 0.1 * at.squared + 1e-18, move)) break;
    double longest = 0.0;
    for (const double m : move) longest = std::max(longest, std::abs(m));
    const double share = longest > kLongestStep ? kLongestStep / longest : 1.0;
    Joints next = q;
    for (std::size_t i = 0; i < chain.count; ++i) next[i] += share * move[i];
    const Linearised there = linearise(chain, wanted, next, length_m);
    // Close to the solution only an improving step is taken, so that the loop does not follow rounding
    // errors.
    if (met(at) && !(there.squared < at.squared)) break;
    q = next;
    at = there;
    if (step % kWatchedSteps == 0) {
      if (!(at.squared < 0.25 * watched)) break;
      watched = at.squared;
    }
  }
  return met(at);
}

/// A sequence of seeds: the hint first, then random ones.
class Seeds {
 public:
  Seeds(const JointChain& chain, const Joints& hint_q, const NumericSearch& search)
      : chain_(chain), hint_q_(hint_q), search_(search), random_(search.seed) {}

  [[nodiscard]] bool next(Joints& q) {
    if (tried_ >= search_.most_seeds) return false;
    q = hint_q_;
    if (tried_++ > 0) {
      for (std::size_t i = 0; i < chain_.count; ++i) {
        const bool turns = chain_.axes[i].kind == JointKind::kRotary;
        const double lower = turns ? -std::numbers::pi : search_.lower_q[i];
        const double upper = turns ? std::numbers::pi : search_.upper_q[i];
        q[i] = lower + (upper - lower) * unit_(random_);
      }
    }
    return true;
  }
  [[nodiscard]] std::uint32_t tried() const { return tried_; }

 private:
  const JointChain& chain_;
  const Joints& hint_q_;
  const NumericSearch& search_;
  std::mt19937_64 random_;
  std::uniform_real_distribution<double> unit_{0.0, 1.0};
  std::uint32_t tried_{};
};

class Search {
 public:
  Search(const JointChain& chain, const Wanted& wanted, const Joints& hint_q)
      : chain_(chain), wanted_(wanted), hint_q_(hint_q), length_m_(length_of(chain)) {}

  /// Returns true if this seed leads to a new solution.
  bool try_seed(Joints q) {
    Linearised at;
    if (!refine(chain_, wanted_, length_m_, q, at)) {
      if (at.squared < nearest_) {
        nearest_ = at.squared;
        found.nearest_m = at.error_m;
        found.nearest_rad = at.error_rad;
      }
      return false;
    }
    for (std::size_t i = 0; i < chain_.count; ++i) {
      if (turns(i)) q[i] = nearest_turn(wrap_angle(q[i]), hint_q_[i]);
    }
    for (std::uint32_t k = 0; k < found.count; ++k) {
      if (same(found.joints_q[k], q)) return false;
    }
    found.joints_q[found.count++] = q;
    return true;
  }

  /// Sorts the solutions by the first joint that differs. Angles count within one turn, so the order does not
  /// depend on the turns that the hint selects.
  void sort() noexcept {
    const auto begin = found.joints_q.begin();
    for (std::uint32_t k = 1; k < found.count; ++k) {
      const auto place =
          std::find_if(begin, begin + k, [&](const Joints& other) { return is_before(begin[k], other); });
      std::rotate(place, begin + k, begin + k + 1);
    }
  }

  NumericSolutions found;

 private:
  [[nodiscard]] bool turns(std::size_t i) const { return chain_.axes[i].kind == JointKind::kRotary; }
  [[nodiscard]] bool same(const Joints& a, const Joints& b) const {
    for (std::size_t i = 0; i < chain_.count; ++i) {
      const double away = a[i] - b[i];
      if (std::abs(turns(i) ? wrap_angle(away) : away) > kDistinct) return false;
    }
    return true;
  }

  [[nodiscard]] bool is_before(const Joints& a, const Joints& b) const {
    for (std::size_t i = 0; i < chain_.count; ++i) {
      if (std::abs(turns(i) ? wrap_angle(a[i] - b[i]) : a[i] - b[i]) <= kAlike) continue;
      // Half a turn to one side counts as half a turn to the other, too.
      return turns(i) ? wrap_angle(a[i] + kAlike) < wrap_angle(b[i] + kAlike) : a[i] < b[i];
    }
    return false;
  }

  const JointChain& chain_;
  Wanted wanted_;
  const Joints& hint_q_;
  double length_m_;
  double nearest_{1e300};
};

Wanted of_pose(const Pose& base_T_tool) noexcept {
  return {{base_T_tool.position_m, normalised(base_T_tool.orientation)}, {}, {}};
}
Wanted of_point(const Kinematics& arm, const PathPoint& point) noexcept {
  Wanted wanted = of_pose({point.position_m, point.orientation});
  if (arm.follows() == Follows::kFull) return wanted;
  wanted.followed = arm.followed();
  wanted.angles_rad = point.angles_rad;
  return wanted;
}

NumericSolutions search_all(const JointChain& chain, const Wanted& wanted, const Joints& hint_q,
                            const NumericSearch& search) {
  Search all(chain, wanted, hint_q);
  Seeds seeds(chain, hint_q, search);
  std::uint32_t quiet = 0;
  for (Joints q; all.found.count < kMaxSolutions && quiet < search.quiet_seeds && seeds.next(q);) {
    quiet = all.try_seed(q) ? 0 : quiet + 1;
  }
  all.found.seeds = seeds.tried();
  all.sort();
  return all.found;
}

NumericSearch search_of(const ArmModel& model) {
  NumericSearch search;
  for (std::size_t i = 0; i < model.dof; ++i) {
    search.lower_q[i] = model.joints[i].lower_q;
    search.upper_q[i] = model.joints[i].upper_q;
  }
  return search;
}

bool is_usable(const JointChain& chain, const Pose& pose, const Joints& hint_q) noexcept {
  double sum = 0.0;
  for (const double joint : hint_q) sum += joint;
  return chain.count > 0 && chain.count <= kMaxJoints && is_finite(pose) && std::isfinite(sum);
}

}  // namespace

bool refine(const JointChain& chain, const Pose& base_T_tool, Joints& joints_q) noexcept {
  if (!is_usable(chain, base_T_tool, joints_q)) return false;
  Linearised at;
  return refine(chain, of_pose(base_T_tool), length_of(chain), joints_q, at);
}

bool refine(const Kinematics& arm, const PathPoint& point, Joints& joints_q) noexcept {
  if (!is_usable(arm.chain(), {point.position_m, point.orientation}, joints_q)) return false;
  Linearised at;
  return refine(arm.chain(), of_point(arm, point), length_of(arm.chain()), joints_q, at);
}

NumericSolutions first_solution(const JointChain& chain, const Pose& base_T_tool, const Joints& hint_q,
                                const NumericSearch& search) {
  if (!is_usable(chain, base_T_tool, hint_q)) return {};
  Search all(chain, of_pose(base_T_tool), hint_q);
  Seeds seeds(chain, hint_q, search);
  for (Joints q; all.found.count == 0 && seeds.next(q);) all.try_seed(q);
  all.found.seeds = seeds.tried();
  return all.found;
}

NumericSolutions all_solutions(const JointChain& chain, const Pose& base_T_tool, const Joints& hint_q,
                               const NumericSearch& search) {
  if (!is_usable(chain, base_T_tool, hint_q)) return {};
  return search_all(chain, of_pose(base_T_tool), hint_q, search);
}

NumericSolutions all_solutions(const ArmModel& model, const Pose& base_T_tool, const Joints& hint_q) {
  return all_solutions(model.kinematics.chain(), base_T_tool, hint_q, search_of(model));
}

NumericSolutions all_solutions(const ArmModel& model, const PathPoint& point, const Joints& hint_q) {
  const Kinematics& arm = model.kinematics;
  if (!is_usable(arm.chain(), {point.position_m, point.orientation}, hint_q)) return {};
  return search_all(arm.chain(), of_point(arm, point), hint_q, search_of(model));
}

}  // namespace corbot::numeric
