// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <random>

#include "corbot/kinematics/pose.h"

namespace corbot::test {

/// Any orientation, up to `size_m` away along each axis.
inline Pose random_frame(std::mt19937_64& engine, double size_m) {
  std::uniform_real_distribution<double> along(-size_m, size_m);
  std::normal_distribution<double> part;
  const Quaternion q{part(engine), part(engine), part(engine), part(engine)};
  return {{along(engine), along(engine), along(engine)}, normalised(q)};
}

}  // namespace corbot::test
