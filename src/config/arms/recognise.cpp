// SPDX-License-Identifier: Apache-2.0
#include "config/arms/recognise.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>
#include <variant>

namespace corbot::config {
namespace {

constexpr int kVerified = 1000;        // number of random joint values
constexpr double kVerifiedTo = 1e-12;  // m and rad, for arms of a metre
constexpr std::uint64_t kSeed = 1751;

struct Difference {
  double m{}, rad{};
};

/// Returns the largest difference between two forward solutions; `reach_m` becomes the farthest tool
/// position.
template <class A, class B>
Difference compare(const JointChain& chain, const A& a, const B& b, double& reach_m) {
  std::mt19937_64 random(kSeed);
  std::uniform_real_distribution<double> unit(-1.0, 1.0);
  Difference worst;
  for (int n = 0; n < kVerified; ++n) {
    Joints q{};
    for (std::size_t i = 0; i < chain.count; ++i) {
      q[i] = (chain.axes[i].kind == JointKind::kRotary ? std::numbers::pi : 1.0) * unit(random);
    }
    const Pose pose_a = a(q), pose_b = b(q);
    reach_m = std::max(reach_m, norm(pose_b.position_m));
    worst.m = std::max(worst.m, norm(pose_a.position_m - pose_b.position_m));
    worst.rad = std::max(worst.rad, angle_between(pose_a.orientation, pose_b.orientation));
  }
  return worst;
}

template <class Given>
RecognisedArm recognised(const JointChain& chain, const Given& given) {
  RecognisedArm arm;
  const JointChain meant = snapped(chain);
  arm.kinematics = Kinematics::recognise(meant);
  double reach_m = 1.0;
  if (std::holds_alternative<OtherArm>(arm.kinematics.form())) {
    arm.reason = explain_other(meant);
  } else {
    const auto by_family = [&](const Joints& q) { return arm.kinematics.forward(q); };
    const auto by_axes = [&](const Joints& q) { return forward(meant, q); };
    const Difference off = compare(chain, by_family, by_axes, reach_m);
    if (!(off.m < kVerifiedTo * reach_m) || !(off.rad < kVerifiedTo)) {
      arm.reason = fmt::format("{}: verification failed, {:.1e} m and {:.1e} rad off its own axes",
                               arm.kinematics.family(), off.m, off.rad);
    }
  }
  if (!arm.reason.empty()) {  // a numerical solution uses the axes as given, not as snapped
    arm.kinematics = Kinematics::other(chain);
  }
  const Difference off = compare(
      chain, [&](const Joints& q) { return arm.kinematics.forward(q); }, given, reach_m);
  arm.difference_m = off.m;
  arm.difference_rad = off.rad;
  return arm;
}

}  // namespace

RecognisedArm recognise_arm(const JointChain& chain) {
  return recognised(chain, [&chain](const Joints& q) { return forward(chain, q); });
}

RecognisedArm recognise_arm(const DhTable& table) {
  return recognised(joint_chain(table), [&table](const Joints& q) { return forward(table, q); });
}

}  // namespace corbot::config
