// SPDX-License-Identifier: Apache-2.0
// Forward and inverse kinematics against Orocos KDL on the same arm, the same poses, alternating in one run.
// KDL's inverse starts 0.2 rad a joint away from the answer,
// a fair seed for a controller that follows a path.
#include <cmath>
#include <kdl/chain.hpp>
#include <kdl/chainfksolverpos_recursive.hpp>
#include <kdl/chainiksolverpos_lma.hpp>
#include <numbers>
#include <random>

#include "config/arms/four_axis.h"
#include "corbot/kinematics/tool_pose.h"
#include "inverse_at_pitch.h"
#include "sampling.h"

namespace {

using corbot::Joints;
using corbot::Kinematics;
using corbot::ToolPose;
using namespace corbot::bench;
using Lengths = corbot::config::FourAxisLengths;

constexpr double kPi = std::numbers::pi;
constexpr std::size_t kPoses = 1000;
constexpr int kRounds = 200;

KDL::Chain kdl_chain(const Lengths& arm) {
  KDL::Chain chain;
  const double a[4] = {0.0, arm.l1_m, arm.l2_m, arm.l3_m};
  const double alpha[4] = {kPi / 2, kPi, kPi, 0.0};
  for (std::size_t i = 0; i < 4; ++i) {
    chain.addSegment(
        KDL::Segment(KDL::Joint(KDL::Joint::RotZ),
                     KDL::Frame::DH(a[i], alpha[i], i == 0 ? arm.l0_m : 0.0, arm.offset_rad[i])));
  }
  return chain;
}

}  // namespace

int main() {
  const Lengths lengths{0.067, 0.120, 0.120, 0.100, {0.0, kPi / 18, 0.0, -kPi / 4}};
  const Kinematics arm = Kinematics::recognise(joint_chain(corbot::config::four_axis_table(lengths)));
  const KDL::Chain chain = kdl_chain(lengths);
  KDL::ChainFkSolverPos_recursive kdl_forward(chain);
  KDL::ChainIkSolverPos_LMA kdl_inverse(chain);

  constexpr std::uint64_t kSeed = 1751;
  std::printf("seed %llu, %zu poses, %d rounds\n", static_cast<unsigned long long>(kSeed), kPoses, kRounds);
  std::mt19937_64 random(kSeed);
  std::uniform_real_distribution<double> unit(-1.0, 1.0);
  std::vector<Joints> joints(kPoses);
  std::vector<ToolPose> poses(kPoses);
  std::vector<std::uint32_t> numbers(kPoses);
  std::vector<KDL::JntArray> kdl_joints(kPoses, KDL::JntArray(4)), kdl_seeds(kPoses, KDL::JntArray(4));
  std::vector<KDL::Frame> kdl_poses(kPoses);
  double worst_m = 0.0;
  for (std::size_t n = 0; n < kPoses; ++n) {
    joints[n] = {
        1.5 * unit(random), 0.8 + 0.9 * unit(random), 1.1 + 0.9 * unit(random), 1.2 * unit(random), 0.0, 0.0};
    for (unsigned i = 0; i < 4; ++i) {
      kdl_joints[n](i) = joints[n][i];
      kdl_seeds[n](i) = joints[n][i] + 0.2 * unit(random);
    }
    poses[n] = tool_pose(arm, joints[n]);
    numbers[n] = arm.solution_of(joints[n]).value_or(0);
    kdl_forward.JntToCart(kdl_joints[n], kdl_poses[n]);
    for (int k = 0; k < 3; ++k) {
      worst_m =
          std::max(worst_m, std::abs(kdl_poses[n].p(k) - poses[n].position_m[static_cast<std::size_t>(k)]));
    }
  }

  std::vector<double> fk, kdl_fk, ik, kdl_ik;
  std::size_t kdl_failed = 0;
  KDL::JntArray answer(4);
  KDL::Frame frame;
  for (int round = 0; round < kRounds; ++round) {
    fk.push_back(time_round(kPoses, [&](std::size_t n) { keep(arm.forward(joints[n])); }));
    kdl_fk.push_back(time_round(kPoses, [&](std::size_t n) {
      kdl_forward.JntToCart(kdl_joints[n], frame);
      keep(frame);
    }));
    ik.push_back(time_round(kPoses, [&](std::size_t n) {
      keep(corbot::test::inverse_at_pitch(arm, poses[n].position_m, poses[n].pitch_rad, numbers[n],
                                          joints[n]));
    }));
    if (round % 10 == 0) {  // the iterative solver would take minutes
      kdl_ik.push_back(time_round(kPoses, [&](std::size_t n) {
        kdl_failed += kdl_inverse.CartToJnt(kdl_seeds[n], kdl_poses[n], answer) < 0 ? 1 : 0;
        keep(answer);
      }));
    }
  }
  const Quantiles fk_q = quantiles(fk), kdl_fk_q = quantiles(kdl_fk), ik_q = quantiles(ik),
                  kdl_ik_q = quantiles(kdl_ik);
  print("forward, corbot", fk_q);
  print("forward, KDL recursive", kdl_fk_q);
  print("inverse, corbot", ik_q);
  print("inverse, KDL LMA", kdl_ik_q);
  std::printf("KDL LMA gave up on %zu of %zu\n", kdl_failed, kdl_ik.size() * kPoses);
  bool good = check("both forward kinematics differ by, in metres", worst_m, "<", 1e-12);
  good &= check("inverse, median in ns", ik_q.median_ns, "<", 250.0);
  good &= check("inverse, KDL LMA over corbot", kdl_ik_q.median_ns / ik_q.median_ns, ">", 200.0);
  good &= check("forward, corbot over KDL", fk_q.median_ns / kdl_fk_q.median_ns, "<", 1.0 / 3.0);
  return good ? 0 : 1;
}
