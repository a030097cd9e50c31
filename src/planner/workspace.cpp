// SPDX-License-Identifier: Apache-2.0
#include "planner/workspace.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <functional>
#include <optional>
#include <random>
#include <utility>

namespace corbot {
namespace {

constexpr std::uint64_t kSeed = 1751;
constexpr std::size_t kSamples = 20000;
constexpr std::size_t kStarts = 6;      // the best of the samples, which are then improved
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

/// Climbs to a maximum, one joint after the other, in steps that are halved.
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

std::vector<std::pair<Joints, Vector3>> samples_of(const ArmModel& arm) {
  std::mt19937_64 random(kSeed);
  std::vector<std::pair<Joints, Vector3>> samples;
  samples.reserve(kSamples);
  for (std::size_t i = 0; i < kSamples; ++i) {
    const Joints q = random_joints(arm, random);
    samples.emplace_back(q, arm.kinematics.forward(q).position_m);
  }
  return samples;
}

}  // namespace

Workspace workspace_of(const ArmModel& arm) {
  const auto samples = samples_of(arm);
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

namespace {

/// Returns the point of the first axis that is nearest to the second, or nothing if they are parallel.
std::optional<Vector3> nearest_to(const JointAxis& first, const JointAxis& second) {
  const Vector3 normal = cross(first.direction, second.direction);
  const double squared = dot(normal, normal);
  if (squared < 1e-12) return std::nullopt;
  const Vector3 apart_m = second.point_m - first.point_m;
  return first.point_m + dot(cross(apart_m, second.direction), normal) / squared * first.direction;
}

}  // namespace

double reach_m(const ArmModel& arm) {
  if (const auto* planar = std::get_if<PlanarArm>(&arm.kinematics.form()); planar != nullptr) {
    const Vector3& tool = planar->mount.hand.position_m;
    return planar->links.upper_m + planar->links.fore_m +
           root_sum(tool[0], root_sum(tool[2], planar->raise_m));
  }
  const JointChain& chain = arm.kinematics.chain();
  const JointAxis& first = chain.axes[0];
  if (arm.dof == 0 || first.kind != JointKind::kRotary) return 0.0;
  const bool second_turns = arm.dof > 1 && chain.axes[1].kind == JointKind::kRotary;
  const auto shoulder_m = second_turns ? nearest_to(first, chain.axes[1]) : std::nullopt;
  const Pose& base = chain.base_T_0;
  const Vector3 at_m = base.position_m + rotate(base.orientation, shoulder_m.value_or(first.point_m));
  const Vector3 axis = rotate(base.orientation, first.direction);
  const Measure distance = [&](const Vector3& tool_m) {
    const Vector3 away_m = tool_m - at_m;
    return norm(shoulder_m ? away_m : away_m - dot(away_m, axis) * axis);
  };
  return greatest(arm, samples_of(arm), distance);
}

}  // namespace corbot
