// SPDX-License-Identifier: Apache-2.0
#include "cli/arm/workspace.h"

#include <Eigen/SVD>
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <functional>
#include <random>
#include <utility>

namespace corbot::cli {
namespace {

constexpr std::uint64_t kSeed = 1751;
constexpr std::size_t kSamples = 20000;
constexpr std::size_t kStarts = 6;      // of which the best are improved
constexpr double kSmallestStep = 1e-7;  // of a range

Joints random_joints(const ArmModel& arm, std::mt19937_64& random) {
  std::uniform_real_distribution<double> unit(0.0, 1.0);
  Joints q{};
  for (std::size_t i = 0; i < arm.dof; ++i) {
    const JointLimits& limits = arm.joints[i];
    q[i] = limits.lower_q + unit(random) * (limits.upper_q - limits.lower_q);
  }
  return q;
}

using Measure = std::function<double(const Vector3&)>;

/// Uphill, one joint after the other, in steps that are halved.
double climb(const ArmModel& arm, const Measure& measure, Joints q) {
  double best = measure(arm.kinematics.forward(q).position_m);
  for (double step = 0.1; step > kSmallestStep;) {
    bool is_better = false;
    for (std::size_t i = 0; i < arm.dof; ++i) {
      const JointLimits& limits = arm.joints[i];
      for (const double sign : {1.0, -1.0}) {
        Joints next = q;
        next[i] = std::clamp(q[i] + sign * step * (limits.upper_q - limits.lower_q), limits.lower_q,
                             limits.upper_q);
        const double value = measure(arm.kinematics.forward(next).position_m);
        if (value <= best) continue;
        best = value;
        q = next;
        is_better = true;
      }
    }
    if (!is_better) step *= 0.5;
  }
  return best;
}

double greatest(const ArmModel& arm, const std::vector<std::pair<Joints, Vector3>>& samples,
                const Measure& measure) {
  std::vector<std::pair<double, std::size_t>> order;
  for (std::size_t i = 0; i < samples.size(); ++i) order.emplace_back(measure(samples[i].second), i);
  const std::size_t starts = std::min(kStarts, order.size());
  std::partial_sort(order.begin(), order.begin() + static_cast<std::ptrdiff_t>(starts), order.end(),
                    std::greater<>());
  double best = order.front().first;
  for (std::size_t i = 0; i < starts; ++i)
    best = std::max(best, climb(arm, measure, samples[order[i].second].first));
  return best;
}

}  // namespace

Workspace workspace_of(const ArmModel& arm) {
  std::mt19937_64 random(kSeed);
  std::vector<std::pair<Joints, Vector3>> samples;
  for (std::size_t i = 0; i < kSamples; ++i) {
    const Joints q = random_joints(arm, random);
    samples.emplace_back(q, arm.kinematics.forward(q).position_m);
  }
  Workspace space;
  for (std::size_t k = 0; k < 3; ++k) {
    space.extent_m[k] = {-greatest(arm, samples, [k](const Vector3& p) { return -p[k]; }),
                         greatest(arm, samples, [k](const Vector3& p) { return p[k]; })};
  }
  const JointChain& chain = arm.kinematics.chain();
  const Vector3 up = rotate(chain.base_T_0.orientation, chain.axes[0].direction);
  space.about_axis = chain.axes[0].kind == JointKind::kRotary && std::abs(std::abs(up[2]) - 1.0) < 1e-9;
  if (!space.about_axis) return space;
  space.axis_m = chain.base_T_0.position_m + rotate(chain.base_T_0.orientation, chain.axes[0].point_m);
  const auto radius = [&](const Vector3& p) {
    return std::hypot(p[0] - space.axis_m[0], p[1] - space.axis_m[1]);
  };
  space.radius_m = {-greatest(arm, samples, [&](const Vector3& p) { return -radius(p); }),
                    greatest(arm, samples, radius)};
  return space;
}

std::vector<Vector3> sample_positions(const ArmModel& arm, std::size_t count,
                                      std::optional<double> joint1_q) {
  std::mt19937_64 random(kSeed);
  std::vector<Vector3> positions;
  positions.reserve(count);
  for (std::size_t i = 0; i < count; ++i) {
    Joints q = random_joints(arm, random);
    if (joint1_q) q[0] = *joint1_q;
    positions.push_back(arm.kinematics.forward(q).position_m);
  }
  return positions;
}

Regularity regularity_at(const Kinematics& arm, const Joints& q) {
  const Jacobian jacobian = arm.jacobian(q);
  const FollowedAngles followed = arm.followed();
  // An arm of fewer than six joints without a closed form is taken as it is: all that its tool does counts.
  const bool by_angles = arm.follows() != Follows::kFull && 3 + followed.count == arm.joint_count();
  const auto columns = static_cast<Eigen::Index>(arm.joint_count());
  const Eigen::Index rows = by_angles ? columns : 6;
  Eigen::MatrixXd task(rows, columns);
  for (Eigen::Index k = 0; k < rows; ++k) {
    const auto row = static_cast<std::size_t>(k);
    for (Eigen::Index i = 0; i < columns; ++i) {
      const auto joint = static_cast<std::size_t>(i);
      task(k, i) = by_angles && row >= 3 ? followed.rows[row - 3][joint] : jacobian[row][joint];
    }
  }
  const Eigen::JacobiSVD<Eigen::MatrixXd> svd(task, Eigen::ComputeFullV);
  Regularity result;
  result.smallest = svd.singularValues()(columns - 1);
  for (Eigen::Index i = 0; i < columns; ++i)
    result.idle_q_s[static_cast<std::size_t>(i)] = svd.matrixV()(i, columns - 1);
  return result;
}

}  // namespace corbot::cli
