// SPDX-License-Identifier: Apache-2.0
#include "sim/scene/capsule.h"

#include <gtest/gtest.h>

#include <limits>
#include <random>
#include <string>

namespace corbot::sim {
namespace {

using Eigen::Vector3d;

/// Returns the least distance of sampled points on both segments, minus the radii. It is never too small.
double sampled_distance_m(const Capsule& a, const Capsule& b, int steps) {
  double least_m = std::numeric_limits<double>::infinity();
  for (int i = 0; i <= steps; ++i) {
    const Vector3d on_a = a.from_m + i / double(steps) * (a.to_m - a.from_m);
    for (int k = 0; k <= steps; ++k) {
      const Vector3d on_b = b.from_m + k / double(steps) * (b.to_m - b.from_m);
      least_m = std::min(least_m, (on_a - on_b).norm());
    }
  }
  return least_m - a.radius_m - b.radius_m;
}

TEST(Capsule, DistanceIsThatOfSampledPoints) {
  const unsigned seed = std::random_device{}();
  SCOPED_TRACE("seed " + std::to_string(seed));
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> coordinate(-0.3, 0.3);
  const auto point = [&] { return Vector3d(coordinate(random), coordinate(random), coordinate(random)); };
  constexpr int kSteps = 100;
  for (int i = 0; i < 100; ++i) {
    Capsule a{point(), point(), 0.02};
    Capsule b{point(), point(), 0.03};
    if (i % 5 == 1) b.to_m = b.from_m + 0.5 * (a.to_m - a.from_m);  // parallel
    if (i % 5 == 2) a.to_m = a.from_m;                              // a ball
    if (i % 10 == 3) b.to_m = b.from_m = a.from_m;                  // a ball on an end
    const double sampled_m = sampled_distance_m(a, b, kSteps);
    const double step_m = ((a.to_m - a.from_m).norm() + (b.to_m - b.from_m).norm()) / kSteps;
    const double distance = distance_m(a, b);
    EXPECT_LE(distance, sampled_m + 1e-9) << i;
    EXPECT_GE(distance, sampled_m - step_m) << i;
    EXPECT_NEAR(distance, distance_m(b, a), 1e-9) << i;
  }
}

}  // namespace
}  // namespace corbot::sim
