// SPDX-License-Identifier: Apache-2.0
// Compares rest-to-rest joint motions with Ruckig (four joints, time-synchronised, the same limits),
// alternating in one run. It also measures the proof of a line, and a line at the limits of every joint.
#include <cmath>
#include <random>
#include <string>

#include "bench_workspace.h"
#include "planner/planner.h"
#include "planner/rate/rate_planner.h"
#include "planner/time_law_planner.h"
#include "sampling.h"
#include "test_arm.h"
#include "test_arms.h"

#ifdef CORBOT_HAS_RUCKIG
#include <ruckig/ruckig.hpp>
#endif

namespace {

using namespace corbot;
using namespace corbot::bench;

constexpr std::size_t kCases = 10'000;
constexpr int kRounds = 40;

struct Case {
  PlanStart start;
  Joints target;
};

double duration_of(const PlanResult& result) {
  return std::get<std::vector<Command>>(result).front().duration_s;
}

/// Lines from Ready and from bent poses: microseconds each, over those that are planned.
bool bench_lines(std::mt19937_64& random) {
  const ArmModel arm = corbot::test::lynx5();
  const Planner planner(arm);
  std::uniform_real_distribution<double> unit(-1.0, 1.0);
  std::vector<double> planned_ns, ready_ns, refused_ns;
  for (int i = 0; i < 20'000; ++i) {
    PlanStart start;
    const bool from_ready = i % 2 == 0;
    if (!from_ready)
      start.position_q = {
          unit(random), 0.7 + 0.5 * unit(random), 1.1 + 0.7 * unit(random), unit(random), 0, 0};
    auto target = tool_pose(arm.kinematics, start.position_q).position_m;
    for (double& x : target) x += 0.15 * unit(random);
    bool planned = false;
    const double ns = time_round(1, [&](std::size_t) {
      planned = std::holds_alternative<std::vector<Command>>(planner.move_s(start, {}, target, 0.0));
    });
    (!planned ? refused_ns : from_ready ? ready_ns : planned_ns).push_back(ns);
  }
  const Quantiles planned = quantiles(planned_ns), ready = quantiles(ready_ns);
  print("line, planned and proved", planned);
  print("line from Ready (singular)", ready);
  print("line, refused", quantiles(refused_ns));
  bool good = check("line, median in ns", planned.median_ns, "<", 1e6);
  good &= check("line from Ready, median in ns", ready.median_ns, "<", 1e6);
  return good;
}

/// Lines in all directions, planned against every limit of every joint: nanoseconds each.
bool bench_rates(std::mt19937_64& random, const std::string& name, double most_ns) {
  const ArmModel arm = corbot::test::arm_of(name);
  const Planner planner(arm);
  std::uniform_real_distribution<double> part(0.0, 1.0);
  std::vector<double> planned_ns;
  while (planned_ns.size() < 1'000) {
    PlanStart start;
    for (std::size_t i = 0; i < arm.dof; ++i)
      start.position_q[i] = std::lerp(arm.joints[i].lower_q, arm.joints[i].upper_q, part(random));
    auto target = arm.kinematics.forward(start.position_q).position_m;
    for (double& x : target) x += 0.3 * (part(random) - 0.5);
    const PlanResult result = planner.move_s(start, {}, target, 0.0);
    if (!std::holds_alternative<std::vector<Command>>(result)) continue;
    const Command& command = std::get<std::vector<Command>>(result).front();
    const double begin_ns = thread_ns();
    const rate::RatePlanned plan = rate::plan_rate(arm, {}, command.line, command.start_q, 0.0);
    const double ns = thread_ns() - begin_ns;
    if (std::holds_alternative<rate::RatePlan>(plan)) planned_ns.push_back(ns);
  }
  const Quantiles planned = quantiles(planned_ns);
  print(("line at the limits, " + name).c_str(), planned);
  return check(("line at the limits, " + name + ", median in ns").c_str(), planned.median_ns, "<", most_ns);
}

/// Joint motions from anywhere to anywhere, among a floor and four posts near the arm and without these,
/// alternating.
bool bench_workspace(std::mt19937_64& random, const std::string& name, std::uint32_t parts) {
  const ArmModel arm = corbot::test::arm_of(name), kept = corbot::test::among_posts(arm, 0.6, parts);
  const Planner planners[2] = {Planner(arm), Planner(kept)};
  std::uniform_real_distribution<double> part(0.0, 1.0);
  std::vector<double> spent_ns[2], refused_ns;
  while (spent_ns[1].size() < 5'000) {
    PlanStart start;
    Joints target{};
    for (std::size_t i = 0; i < arm.dof; ++i) {
      start.position_q[i] = std::lerp(arm.joints[i].lower_q, arm.joints[i].upper_q, part(random));
      target[i] = std::lerp(arm.joints[i].lower_q, arm.joints[i].upper_q, part(random));
    }
    double ns[2]{};
    bool planned = false;
    for (std::size_t k = 0; k < 2; ++k) {
      ns[k] = time_round(1, [&](std::size_t) {
        planned =
            std::holds_alternative<std::vector<Command>>(planners[k].move_joints(start, {}, target, 0.0));
      });
    }
    if (!planned) refused_ns.push_back(ns[1]);
    for (std::size_t k = 0; k < 2 && planned; ++k) spent_ns[k].push_back(ns[k]);
  }
  const Quantiles free = quantiles(spent_ns[0]), proved = quantiles(spent_ns[1]);
  print((name + ", joint motion alone").c_str(), free);
  print((name + ", a floor and four boxes").c_str(), proved);
  print((name + ", refused by these").c_str(), quantiles(refused_ns));
  std::printf("%s: %.1f times the motion alone\n", name.c_str(), proved.median_ns / free.median_ns);
  return check((name + ", a floor and four boxes, median in ns").c_str(), proved.median_ns, "<", 1e5);
}

}  // namespace

int main() {
  const ArmModel arm = corbot::test::wide_arm();
  const Planner planner(arm);
  constexpr std::uint64_t kSeed = 1751;
  std::printf("seed %llu, %zu cases, %d rounds\n", static_cast<unsigned long long>(kSeed), kCases, kRounds);
  std::mt19937_64 random(kSeed);
  std::uniform_real_distribution<double> angle(-3.0, 3.0);
  std::uniform_real_distribution<double> exponent(-6.0, 0.0);
  std::vector<Case> cases(kCases);
  for (std::size_t n = 0; n < kCases; ++n) {
    const double scale = n % 2 == 0 ? 1.0 : std::pow(10.0, exponent(random));
    for (std::size_t i = 0; i < 4; ++i) {
      cases[n].start.position_q[i] = angle(random);
      const double goal = cases[n].start.position_q[i] + scale * angle(random);
      cases[n].target[i] = std::fmin(3.0, std::fmax(-3.0, goal));
    }
  }
  std::vector<double> own_s(kCases), own_ns;
  const auto plan_own = [&](std::size_t n) {
    own_s[n] = duration_of(planner.move_joints(cases[n].start, {}, cases[n].target, 0.0));
  };
  bool good = true;
#ifdef CORBOT_HAS_RUCKIG
  ruckig::Ruckig<4> generator;
  std::vector<ruckig::InputParameter<4>> inputs(kCases);
  for (std::size_t n = 0; n < kCases; ++n) {
    for (std::size_t i = 0; i < 4; ++i) {
      inputs[n].current_position[i] = cases[n].start.position_q[i];
      inputs[n].target_position[i] = cases[n].target[i];
      inputs[n].max_velocity[i] = arm.joints[i].speed_q_s;
      inputs[n].max_acceleration[i] = arm.joints[i].acceleration_q_s2;
      inputs[n].max_jerk[i] = arm.joints[i].jerk_q_s3;
    }
  }
  std::vector<double> ruckig_s(kCases), ruckig_ns;
  ruckig::Trajectory<4> trajectory;
  std::size_t failed = 0;
  for (int round = 0; round < kRounds; ++round) {
    own_ns.push_back(time_round(kCases, plan_own));
    ruckig_ns.push_back(time_round(kCases, [&](std::size_t n) {
      failed += generator.calculate(inputs[n], trajectory) < 0 ? 1 : 0;
      ruckig_s[n] = trajectory.get_duration();
    }));
  }
  double worst_s = 0.0;
  for (std::size_t n = 0; n < kCases; ++n) worst_s = std::fmax(worst_s, std::abs(own_s[n] - ruckig_s[n]));
  const Quantiles own = quantiles(own_ns), peer = quantiles(ruckig_ns);
  print("four joints, corbot move_joints", own);
  print("four joints, Ruckig calculate", peer);
  std::printf("Ruckig failed on %zu\n", failed);
  good &= check("durations differ by, in s", worst_s, "<", 1e-6);
  good &= check("corbot over Ruckig", own.median_ns / peer.median_ns, "<", 0.15);
#else
  for (int round = 0; round < kRounds; ++round) own_ns.push_back(time_round(kCases, plan_own));
  print("four joints, corbot move_joints", quantiles(own_ns));
  std::printf("built without Ruckig: set CORBOT_RUCKIG_DIR to compare\n");
#endif
  good &= bench_lines(random);
  good &= bench_rates(random, "lynx5", 1e6);
  good &= bench_rates(random, "puma560", 3e6);
  for (const char* name : {"lynx5", "puma560", "scara_gx4"}) {
    good &= bench_workspace(random, name, corbot::test::kPoints);
    std::printf("points and links:\n");
    good &= bench_workspace(random, name, corbot::test::kPointsAndLinks);
  }
  return good ? 0 : 1;
}
