// SPDX-License-Identifier: Apache-2.0
// All solutions of six-axis arms, against one of Orocos KDL's LMA on the same table and the same poses,
// alternating in one run. KDL starts 0.2 rad a joint away from a solution, a fair seed for a controller that
// follows a path.
#include <cmath>
#include <kdl/chain.hpp>
#include <kdl/chainfksolverpos_recursive.hpp>
#include <kdl/chainiksolverpos_lma.hpp>
#include <random>
#include <string>

#include "arm_vectors.h"
#include "corbot/kinematics/arm_kinematics.h"
#include "sampling.h"

namespace {

using namespace corbot;
using namespace corbot::bench;

constexpr std::size_t kPoses = 1000;
constexpr int kRounds = 200;

KDL::Chain kdl_chain(const DhTable& table) {
  KDL::Chain chain;
  for (std::size_t i = 0; i < table.count; ++i) {
    const DhRow& row = table.rows[i];
    chain.addSegment(KDL::Segment(KDL::Joint(KDL::Joint::RotZ),
                                  KDL::Frame::DH(row.a_m, row.alpha_rad, row.d_m, row.theta_rad)));
  }
  return chain;
}

bool compare(const std::string& name, std::uint64_t seed) {
  DhTable table = test::arm_vectors(name).table;
  table.base_T_0 = {};
  table.n_T_tool = {};
  const Kinematics arm = Kinematics::recognise(joint_chain(table));
  const KDL::Chain chain = kdl_chain(table);
  KDL::ChainFkSolverPos_recursive kdl_forward(chain);
  KDL::ChainIkSolverPos_LMA kdl_inverse(chain);

  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> unit(-1.0, 1.0);
  std::vector<Joints> joints(kPoses);
  std::vector<Pose> poses(kPoses);
  std::vector<KDL::JntArray> kdl_seeds(kPoses, KDL::JntArray(6));
  std::vector<KDL::Frame> kdl_poses(kPoses);
  double worst_m = 0.0, found = 0.0;
  for (std::size_t n = 0; n < kPoses; ++n) {
    KDL::JntArray q(6);
    for (unsigned i = 0; i < 6; ++i) {
      joints[n][i] = 3.0 * unit(random);
      q(i) = joints[n][i];
      kdl_seeds[n](i) = joints[n][i] + 0.2 * unit(random);
    }
    poses[n] = arm.forward(joints[n]);
    kdl_forward.JntToCart(q, kdl_poses[n]);
    for (std::size_t k = 0; k < 3; ++k) {
      worst_m = std::max(worst_m, std::abs(kdl_poses[n].p(static_cast<int>(k)) - poses[n].position_m[k]));
    }
    found += arm.solutions(poses[n], joints[n], 1e-6).count;
  }

  std::vector<double> all, one, kdl_one;
  std::size_t kdl_failed = 0;
  KDL::JntArray answer(6);
  for (int round = 0; round < kRounds; ++round) {
    all.push_back(time_round(kPoses, [&](std::size_t n) { keep(arm.solutions(poses[n], joints[n], 1e-6)); }));
    one.push_back(time_round(kPoses, [&](std::size_t n) {
      keep(arm.inverse(poses[n], static_cast<std::uint32_t>(n % 8), joints[n]));
    }));
    if (round % 20 == 0) {  // the iterative solver would take minutes
      kdl_one.push_back(time_round(kPoses, [&](std::size_t n) {
        kdl_failed += kdl_inverse.CartToJnt(kdl_seeds[n], kdl_poses[n], answer) < 0 ? 1 : 0;
        keep(answer);
      }));
    }
  }
  const Quantiles all_q = quantiles(all), kdl_q = quantiles(kdl_one);
  std::printf("%s, %.2f solutions a pose\n", name.c_str(), found / static_cast<double>(kPoses));
  print("all solutions, corbot", all_q);
  print("inverse of one number, corbot", quantiles(one));
  print("one solution, KDL LMA", kdl_q);
  std::printf("KDL LMA gave up on %zu of %zu\n", kdl_failed, kdl_one.size() * kPoses);
  bool good = check("both forward kinematics differ by, in metres", worst_m, "<", 1e-12);
  good &= check("one by KDL LMA over all by corbot", kdl_q.median_ns / all_q.median_ns, ">", 100.0);
  return good;
}

}  // namespace

int main() {
  constexpr std::uint64_t kSeed = 1751;
  std::printf("seed %llu, %zu poses, %d rounds\n", static_cast<unsigned long long>(kSeed), kPoses, kRounds);
  bool good = true;
  for (const char* name : {"puma560", "irb2400", "ur5e"}) good = compare(name, kSeed) && good;
  return good ? 0 : 1;
}
