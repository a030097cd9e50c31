// SPDX-License-Identifier: Apache-2.0
// Random motions of arms of all kinds among random floors, planes and boxes, stopped at random instants.
// Planned motions keep to the shapes in a dense reference, refused ones would not, and no set-point of the
// task is outside. CORBOT_MOTIONS, CORBOT_SEED and CORBOT_MOTION_RESULTS are those of motion_test.cpp.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <random>
#include <string>

#include "corbot/kinematics/arm_parts.h"
#include "corbot/motion/law_evaluation.h"
#include "corbot/motion/rate_knots.h"
#include "motion/motion_results.h"
#include "motion/workspace_case.h"
#include "planner/workspace_proof.h"
#include "random_settings.h"
#include "rt/rig.h"

namespace corbot::test::workspace_motions_test {
namespace {

constexpr std::uint64_t kDefaultMotions = CORBOT_SANITIZED ? 100 : 1200;
constexpr std::uint64_t kMotionsOfOneRig = 4;
constexpr std::uint64_t kEnoughForEach = 100;  ///< motions, to see a start outside, too
constexpr int kSteps = 400;                    ///< of the reference in a command, before it refines the least
constexpr double kRounding_m = 1e-9;           ///< of the task's arithmetic against the planner's
/// The reference may miss a breach by this much between two of its points.
constexpr double kMissed_m = 1e-5;
constexpr double kMostTravel_m = 0.1;  ///< of a part between two of the reference's first points

std::uint64_t environment(const char* name, std::uint64_t otherwise) {
  const char* text = std::getenv(name);
  return text == nullptr ? otherwise : std::strtoull(text, nullptr, 10);
}

/// The joints at a share of a command.
Joints joints_at(const Command& command, const PlannedRate* rate, double share) {
  Joints q = command.start_q;
  if (command.kind == MotionKind::kJoint) {
    for (std::size_t i = 0; i < q.size(); ++i)
      q[i] += evaluate(command.joint.law[i], share * command.duration_s).position;
  } else if (rate != nullptr && !rate->knots.empty()) {
    const double length_s = rate->knots.back().lambda_s;
    std::copy_n(rate::state_at(rate->knots, share * length_s).begin(), q.size(), q.begin());
  }
  return q;
}

/// One shape, and one part of the arm that it holds for.
struct Guard {
  std::size_t shape, part;
};

/// All shapes of an arm with the parts that they hold for.
class Guards {
 public:
  explicit Guards(const ArmModel& arm) : arm_(arm), parts_(parts_of(points_of(arm.kinematics.chain()))) {
    for (std::size_t k = 0; k < arm.workspace.count; ++k) {
      for (std::size_t part = 0; part < kArmParts; ++part)
        if (parts_[part].exists && (arm.workspace.shapes[k].parts & bit_of(part)) != 0)
          guards_.push_back({k, part});
    }
  }
  /// The clearance of each guard.
  [[nodiscard]] std::vector<double> clearances(const Joints& q) const {
    const ArmStates states = states_at(q);
    std::vector<double> clearances_m;
    for (const Guard& guard : guards_) clearances_m.push_back(clearance(guard, states));
    return clearances_m;
  }
  /// The least clearance of a command beyond that of its start: at many points, and near the least of them.
  [[nodiscard]] double least(const Command& command, const PlannedRate* rate) const {
    struct Least {
      double clearance_m, share;
    };
    const std::vector<double> start_m = clearances(joints_at(command, rate, 0.0));
    std::vector<Least> found(guards_.size(), {1e9, 0.0});
    for (int i = 0; i <= kSteps; ++i) {
      const double share = static_cast<double>(i) / kSteps;
      const std::vector<double> here_m = clearances(joints_at(command, rate, share));
      for (std::size_t g = 0; g < guards_.size(); ++g)
        if (here_m[g] < found[g].clearance_m) found[g] = {here_m[g], share};
    }
    double least_m = 1e9;
    for (std::size_t g = 0; g < guards_.size(); ++g) {
      const auto look = [&](double share) {
        const double at = std::clamp(share, 0.0, 1.0);
        const double here_m = clearance(guards_[g], states_at(joints_at(command, rate, at)));
        if (here_m < found[g].clearance_m) found[g] = {here_m, at};
      };
      const double allowed_m = std::min(0.0, start_m[g]);
      // No part travels so far between two of the points.
      if (found[g].clearance_m - allowed_m > least_m + kMostTravel_m) continue;
      for (double width = 2.0 / kSteps; width > 1e-8; width *= 0.5) {
        const double middle = found[g].share;
        look(middle - 0.5 * width);
        look(middle + 0.5 * width);
      }
      least_m = std::min(least_m, found[g].clearance_m - allowed_m);
    }
    return least_m;
  }

 private:
  [[nodiscard]] ArmStates states_at(const Joints& q) const {
    const JointChain& chain = arm_.kinematics.chain();
    return part_states(chain, points_of(chain), q);
  }
  [[nodiscard]] double clearance(const Guard& guard, const ArmStates& states) const {
    return clearance_m(arm_.workspace, guard.shape, guard.part, parts_[guard.part], states);
  }

  const ArmModel& arm_;
  ArmParts parts_;
  std::vector<Guard> guards_;
};

/// The least clearance of a motion beyond what its start allows: at least 0 if the motion keeps inside.
double least_clearance(const ArmModel& arm, const PlanResult& result) {
  const auto& commands = std::get<std::vector<Command>>(result);
  const Guards guards(arm);
  double least_m = 1e9;
  for (std::size_t c = 0; c < commands.size(); ++c)
    least_m =
        std::min(least_m, guards.least(commands[c], c < result.rates.size() ? &result.rates[c] : nullptr));
  return least_m;
}

class WorkspaceMotions : public ::testing::TestWithParam<const char*> {
 protected:
  ArmModel draw_arm(std::uint64_t shapes) {
    ArmModel arm = free_arm_;
    arm.period_ns = 4'000'000;
    arm.workspace.count = static_cast<std::uint32_t>(shapes);
    (void)draw_.radii(arm);
    for (std::size_t k = 0; k < arm.workspace.count; ++k) arm.workspace.shapes[k] = draw_.shape();
    return arm;
  }
  /// Plans a motion with and without the workspace, and compares both with the reference.
  PlanResult plan(Rig& rig, int number) {
    const PlanStart start = rig.start();
    const PlanSettings settings = random_settings(
        free_arm_, number, start, [&](double low, double high) { return draw_.in(low, high); });
    const MotionRequest request = draw_.request(number % 5, start);
    PlanResult kept = rig.planner.plan(start, settings, request);
    const PlanResult free = Planner(free_arm_).plan(start, settings, request);
    if (std::holds_alternative<PlanRefusal>(free)) {
      EXPECT_TRUE(std::holds_alternative<PlanRefusal>(kept));
      return kept;
    }
    judge(rig.arm, free, kept);
    const ArmModel grazed = grazed_by(std::get<std::vector<Command>>(free), free);
    judge(grazed, free, Planner(grazed).plan(start, settings, request));
    return kept;
  }
  /// The arm with one plane that the motion touches, or misses by a few tolerances.
  ArmModel grazed_by(const std::vector<Command>& commands, const PlanResult& free) {
    ArmModel arm = free_arm_;
    arm.workspace.count = 1;
    WorkspaceShape& plane = arm.workspace.shapes[0];
    // A tool, or the last link that the arm has.
    std::size_t part = draw_.radii(arm);
    if (draw_.in(0.0, 1.0) < 0.5) part = 0;
    plane = plane_shape({draw_.unit(), -1e3}, bit_of(part));
    const PlannedRate* rate = free.rates.empty() ? nullptr : &free.rates[0];
    plane.faces[0].offset_m += Guards(arm).least(commands[0], rate) + draw_.in(-3e-6, 3e-6);
    return arm;
  }
  void judge(const ArmModel& arm, const PlanResult& free, const PlanResult& kept) {
    ++results_.counts["workspace_motions"];
    if (const auto* refusal = std::get_if<PlanRefusal>(&kept))
      return judge_refusal(*refusal, least_clearance(arm, free));
    const double least_m = least_clearance(arm, kept);
    const bool is_false = least_m < -kWorkspaceTolerance_m - 1e-12;
    results_.counts["workspace_false_acceptances"] += is_false ? 1 : 0;
    results_.see("workspace_beyond_m", -least_m);
    EXPECT_FALSE(is_false) << least_m;
  }
  void judge_refusal(const PlanRefusal& refusal, double free_m) {
    ++results_.counts["workspace_refusals"];
    EXPECT_TRUE(leaves_workspace(refusal)) << refusal.text;
    EXPECT_LT(free_m, kMissed_m) << refusal.text;
    const bool is_unproved = refusal.text.find("too close") != std::string::npos;  // but perhaps not beyond
    if (!is_unproved) {
      EXPECT_LT(refusal.value, refusal.lower) << refusal.text;
    }
    // A part that begins outside may end no deeper, and beside an edge there may be no proof.
    const bool is_false = free_m >= -0.5 * kWorkspaceTolerance_m ||
                          refusal.value >= refusal.lower - 0.4 * kWorkspaceTolerance_m;
    results_.counts["workspace_false_refusals"] += is_false ? 1 : 0;
    results_.see("workspace_refused_at_m", free_m);
  }
  /// Requests a stop of one of several kinds.
  static void interrupt(Rig& rig, std::uint64_t last_id, int kind) {
    if (kind == 1) rig.stop();
    if (kind == 2) rig.cancel(0, last_id);
    if (kind == 3) rig.pause(true);
    if (kind == 4) rig.override_to(0.3);
  }
  /// Runs all commands up to this one to their ends, with an interruption in one cycle and a Stop later.
  void run(Rig& rig, std::uint64_t last_id, int kind, int cycles) {
    const Guards guards(rig.arm);
    std::vector<double> allowed_m = guards.clearances(rig.snapshot.position_q);
    for (double& each_m : allowed_m) each_m = std::min(0.0, each_m);
    const bool was_outside =
        std::any_of(allowed_m.begin(), allowed_m.end(), [](double m) { return m < 0.0; });
    const int first = static_cast<int>(draw_.in(1, cycles)),
              second = first + static_cast<int>(draw_.in(1, 60));
    for (int i = 0; rig.snapshot.last_done_id < last_id && i < cycles + 10'000 && !HasFailure(); ++i) {
      if (i == first) interrupt(rig, last_id, kind);
      if (i == second && kind >= 3) rig.stop();
      rig.step();
      ++results_.counts["workspace_ticks"];
      const std::vector<double> here_m = guards.clearances(rig.snapshot.position_q);
      for (std::size_t k = 0; k < here_m.size(); ++k) {
        const double beyond_m = allowed_m[k] - here_m[k];
        results_.see("workspace_set_point_beyond_m", beyond_m);
        EXPECT_LE(beyond_m, kWorkspaceTolerance_m + kRounding_m);
      }
    }
    results_.counts["workspace_starts_outside"] += was_outside ? 1 : 0;
    results_.counts["workspace_stopped"] += kind != 0 ? 1 : 0;
    rig.pause(false);
    rig.override_to(1.0);
    rig.step(3);  // a Stop is done a cycle after the motion
    const auto alarm = rig.alarm();
    EXPECT_FALSE(alarm) << fmt::format("alarm {} of joint {}: {:.9g} {:.9g} {:.9g}; interruption {}",
                                       static_cast<int>(alarm->code), alarm->joint, alarm->value,
                                       alarm->lower, alarm->upper, kind);
    EXPECT_EQ(rig.snapshot.state, RtState::kStandby);
    while (rig.completion()) {
    }
  }

  std::mt19937_64 random_;
  const ArmModel free_arm_ = arm_of(GetParam());
  const WorkspaceCase draw_{free_arm_, random_};
  MotionResults results_;
};

TEST_P(WorkspaceMotions, StayInsideAndRefusedOnesWouldNot) {
  const std::uint64_t seed = environment("CORBOT_SEED", 1751);
  const std::uint64_t motions =
      (environment("CORBOT_MOTIONS", kDefaultMotions) + kTestArms.size() - 1) / kTestArms.size();
  random_.seed(seed);
  for (std::uint64_t i = 0; results_.counts["workspace_motions"] < motions && !HasFailure(); ++i) {
    Rig rig(draw_arm(1 + i % 5));
    rig.restart({.position_q = draw_.joints(), .position_known = true});
    rig.step();
    for (std::uint64_t k = 0; k < kMotionsOfOneRig && !HasFailure(); ++k) {
      SCOPED_TRACE(fmt::format("CORBOT_SEED={} rig {} motion {}", seed, i, k));
      const PlanResult kept = plan(rig, static_cast<int>(i + k));
      const auto* commands = std::get_if<std::vector<Command>>(&kept);
      if (commands == nullptr) continue;
      double duration_s = 0.0;
      for (const Command& command : *commands) duration_s += command.duration_s;
      const auto cycles = static_cast<int>(duration_s * 1e9 / static_cast<double>(rig.arm.period_ns)) + 2;
      run(rig, rig.submit(kept), std::uniform_int_distribution<int>(0, 4)(random_), cycles);
    }
  }
  if (motions >= kEnoughForEach) {
    EXPECT_GT(results_.counts["workspace_refusals"], 0u);
    EXPECT_GT(results_.counts["workspace_starts_outside"], 0u);
    EXPECT_GT(results_.counts["workspace_stopped"], 0u);
  }
  EXPECT_EQ(results_.counts["workspace_false_acceptances"], 0u);
  EXPECT_LE(results_.counts["workspace_false_refusals"], 1 + motions / 1000);
  fmt::print("{}\n", to_string(results_));
  run_results().add(results_);
}

INSTANTIATE_TEST_SUITE_P(Random, WorkspaceMotions, ::testing::ValuesIn(kTestArms),
                         [](const auto& test) { return std::string(test.param); });

}  // namespace
}  // namespace corbot::test::workspace_motions_test
