// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <iostream>
#include <limits>
#include <numbers>
#include <random>
#include <vector>

#include "../../support/cases.h"
#include "arm_vectors.h"
#include "corbot/kinematics/arm_kinematics.h"
#include "planner/numeric/numeric_inverse.h"

namespace corbot::numeric::numeric_inverse_test {
namespace {

using test::arm_vectors;
using test::ArmVectors;
using test::CsvRow;
using test::read_csv;

constexpr double kPi = std::numbers::pi;

struct NumericArm {
  explicit NumericArm(const std::string& name)
      : vectors(arm_vectors(name)), chain(joint_chain(vectors.table)) {
    search.lower_q = vectors.lower_q;
    search.upper_q = vectors.upper_q;
    for (std::size_t i = 0; i < chain.count; ++i) {
      if (chain.axes[i].kind == JointKind::kPrismatic) search.lower_q[i] = -search.upper_q[i];
    }
  }
  [[nodiscard]] double apart(const Joints& a, const Joints& b) const {
    double worst = 0.0;
    for (std::size_t i = 0; i < chain.count; ++i) {
      const bool turns = chain.axes[i].kind == JointKind::kRotary;
      worst = std::max(worst, std::abs(turns ? wrap_angle(a[i] - b[i]) : a[i] - b[i]));
    }
    return worst;
  }
  ArmVectors vectors;
  JointChain chain;
  NumericSearch search;
};

void expect_met(const JointChain& chain, const Joints& q, const Pose& pose) {
  const Pose back = forward(chain, q);
  EXPECT_LT(norm(back.position_m - pose.position_m), 1e-9);
  EXPECT_LT(angle_between(back.orientation, pose.orientation), 1e-9);
}

class Numeric : public testing::TestWithParam<const char*> {};

TEST_P(Numeric, FindsEverySolutionAndInventsNone) {
  const NumericArm arm(GetParam());
  std::map<std::string, std::vector<Joints>> expected;
  for (const CsvRow& row : read_csv(std::string(GetParam()) + "_ik_solutions.csv")) {
    expected[row.at("pose")].push_back(test::joints(row, 6));
  }
  for (const CsvRow& row : read_csv(std::string(GetParam()) + "_ik_counts.csv")) {
    const Pose pose = test::pose(row);
    const NumericSolutions found = all_solutions(arm.chain, pose, {}, arm.search);
    const std::vector<Joints>& known = expected[row.at("pose")];
    EXPECT_EQ(found.count, known.size()) << "pose " << row.at("pose") << " " << row.at("kind");
    for (std::uint32_t k = 0; k < found.count; ++k) {
      expect_met(arm.chain, found.joints_q[k], pose);
      EXPECT_TRUE(std::any_of(known.begin(), known.end(),
                              [&](const Joints& q) { return arm.apart(q, found.joints_q[k]) < 1e-7; }))
          << "pose " << row.at("pose") << ": solution " << k << " is invented";
    }
    if (found.count == 0) {
      EXPECT_GT(found.nearest_m + found.nearest_rad, 1e-4);
    }
  }
}

TEST_P(Numeric, SolvesEveryRow) {
  const NumericArm arm(GetParam());
  for (const CsvRow& row : read_csv(std::string(GetParam()) + ".csv")) {
    const Pose pose = test::pose(row);
    const NumericSolutions found = first_solution(arm.chain, pose, {}, arm.search);
    ASSERT_EQ(found.count, 1u) << row.at("case");
    expect_met(arm.chain, found.joints_q[0], pose);
  }
}

INSTANTIATE_TEST_SUITE_P(SixJoints, Numeric,
                         testing::Values("xarm6", "puma560", "irb2400", "ur5e", "stanford"));

/// Tables of six turning joints with nothing parallel, square or crossing.
DhTable any_table(std::mt19937_64& random) {
  std::uniform_real_distribution<double> unit(-1.0, 1.0);
  DhTable table;
  table.count = 6;
  for (DhRow& row : table.rows) {
    row = {JointKind::kRotary, kPi * unit(random), 0.3 * unit(random), 0.3 * unit(random),
           kPi * unit(random)};
  }
  return table;
}

/// The inverse solves 99.9 % of random poses within reach from a hundred seeds, some milliseconds.
void expect_nearly_all_solved(const std::function<JointChain(std::mt19937_64&, int)>& chain_of) {
  std::mt19937_64 random(test::seed());
  std::uniform_real_distribution<double> angle(-kPi, kPi);
  const int cases = test::cases(10'000);
  int good = 0;
  std::uint32_t most_seeds = 0;
  for (int k = 0; k < cases; ++k) {
    const JointChain chain = chain_of(random, k);
    Joints q{}, hint{};
    for (double& joint : q) joint = angle(random);
    for (double& joint : hint) joint = 2.0 * angle(random);
    const Pose pose = forward(chain, q);
    const NumericSolutions found = first_solution(chain, pose, hint, {});
    most_seeds = std::max(most_seeds, found.seeds);
    if (found.count == 0 || found.seeds > 100) continue;
    expect_met(chain, found.joints_q[0], pose);
    for (std::size_t i = 0; i < 6; ++i) ASSERT_LE(std::abs(found.joints_q[0][i] - hint[i]), kPi + 1e-9);
    ++good;
  }
  std::cout << cases - good << " of " << cases << " not solved from 100 seeds; most seeds " << most_seeds
            << "\n";
  EXPECT_GE(good, cases * 0.999);
}

TEST(NumericSearch, SolvesNearlyEveryReachablePoseOfXarm6) {
  const JointChain chain = joint_chain(arm_vectors("xarm6").table);
  expect_nearly_all_solved([&](std::mt19937_64&, int) { return chain; });
}

TEST(NumericSearch, SolvesNearlyEveryReachablePoseOfAnyTable) {
  JointChain chain;
  expect_nearly_all_solved([&](std::mt19937_64& random, int k) {
    if (k % 50 == 0) chain = joint_chain(any_table(random));
    return chain;
  });
}

TEST(NumericSearch, FindsTheSolutionsOfACalibratedArmNextToTheNominalOnes) {
  const JointChain nominal = joint_chain(arm_vectors("ur5e").table);
  const Kinematics closed = Kinematics::recognise(nominal);
  JointChain real = nominal;
  for (std::size_t i = 0; i < 6; ++i) {
    JointAxis& axis = real.axes[i];
    axis.direction = axis.direction + Vector3{2e-4, -1e-4, 3e-4};
    axis.direction = (1.0 / norm(axis.direction)) * axis.direction;
    axis.point_m = axis.point_m + Vector3{1e-4, 2e-4, -1e-4};
  }
  const Joints q{0.4, -1.2, 1.3, -0.8, 1.1, 0.2};
  const Pose pose = forward(real, q);
  const SolutionSet seeds = closed.solutions(pose, q, 1e-9);
  EXPECT_EQ(seeds.count, 8u);
  for (const auto& [number, solution] : seeds) {
    Joints refined = solution.joints_q;
    ASSERT_TRUE(refine(real, pose, refined)) << number;
    expect_met(real, refined, pose);
    for (std::size_t i = 0; i < 6; ++i) EXPECT_NEAR(refined[i], solution.joints_q[i], 0.02);
  }
  EXPECT_EQ(all_solutions(real, pose, q, {}).count, 8u);
}

TEST(NumericSearch, GivesTheSameSolutionsInTheSameOrderAgain) {
  const JointChain chain = joint_chain(arm_vectors("xarm6").table);
  const Pose pose = forward(chain, {0.4, -0.3, -1.2, 0.5, 0.9, -0.1});
  const NumericSolutions once = all_solutions(chain, pose, {}, {});
  NumericSearch other;
  other.seed = 42;
  const NumericSolutions again = all_solutions(chain, pose, {}, other);
  ASSERT_GT(once.count, 1u);
  ASSERT_EQ(once.count, again.count);
  for (std::uint32_t k = 0; k < once.count; ++k) {
    for (std::size_t i = 0; i < 6; ++i) EXPECT_NEAR(once.joints_q[k][i], again.joints_q[k][i], 1e-8);
  }
}

/// The hint says at which turn a joint is shown, and is the first seed: neither makes another solution of a
/// number.
TEST(NumericSearch, CountsSolutionsAlikeWhereverTheArmIs) {
  for (const char* name : {"xarm6", "puma560", "ur5e"}) {
    const NumericArm arm(name);
    const Pose pose = forward(arm.chain, {0.4, -0.3, -1.2, 0.5, 0.9, -0.1});
    const NumericSolutions once = all_solutions(arm.chain, pose, {}, {});
    ASSERT_GT(once.count, 1u) << name;
    std::mt19937_64 random(1751);
    std::uniform_real_distribution<double> angle(-2.0 * kPi, 2.0 * kPi);
    for (int i = 0; i < 6; ++i) {
      Joints hint{};
      for (double& joint : hint) joint = angle(random);
      const NumericSolutions again = all_solutions(arm.chain, pose, hint, {});
      ASSERT_EQ(again.count, once.count) << name;
      for (std::uint32_t k = 0; k < once.count; ++k)
        EXPECT_LT(arm.apart(once.joints_q[k], again.joints_q[k]), 1e-6) << name << " solution " << k;
    }
  }
}

TEST(NumericSearch, KeepsTheSolutionOfItsHint) {
  const JointChain chain = joint_chain(arm_vectors("xarm6").table);
  const Joints q{0.4, -0.3, -1.2, 0.5, 0.9, -0.1};
  Joints near = q;
  for (double& joint : near) joint += 3e-3;
  near[5] += 2.0 * kPi;
  const NumericSolutions found = first_solution(chain, forward(chain, q), near, {});
  ASSERT_EQ(found.count, 1u);
  EXPECT_EQ(found.seeds, 1u);
  for (std::size_t i = 0; i < 5; ++i) EXPECT_NEAR(found.joints_q[0][i], q[i], 1e-9);
  EXPECT_NEAR(found.joints_q[0][5], q[5] + 2.0 * kPi, 1e-9);
}

TEST(NumericSearch, RefusesWhatIsNoNumberAndEndsWhereNothingIs) {
  const JointChain chain = joint_chain(arm_vectors("xarm6").table);
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(all_solutions(chain, {{nan, 0.0, 0.0}, {}}, {}, {}).count, 0u);
  EXPECT_EQ(all_solutions(chain, {{0.3, 0.0, 0.3}, {0.0, 0.0, 0.0, 0.0}}, {}, {}).count, 0u);
  EXPECT_EQ(first_solution(chain, {{0.3, 0.0, 0.3}, {}}, {nan}, {}).count, 0u);
  Joints q{nan};
  EXPECT_FALSE(refine(chain, {}, q));
  EXPECT_EQ(all_solutions(JointChain{}, {}, {}, {}).count, 0u);
  NumericSearch short_one;
  short_one.most_seeds = 50;
  const NumericSolutions none = first_solution(chain, {{2.0, 0.0, 0.3}, {}}, {}, short_one);
  EXPECT_EQ(none.count, 0u);
  EXPECT_EQ(none.seeds, 50u);
  EXPECT_GT(none.nearest_m, 1.0);
}

TEST(NumericSearch, GivesAtMostSixteenWhereAJointIsFree) {
  const JointChain chain = joint_chain(arm_vectors("puma560").table);
  const Pose pose = forward(chain, {0.3, -0.7, 0.9, 0.4, 0.0, -0.2});
  const NumericSolutions found = all_solutions(chain, pose, {}, {});
  EXPECT_EQ(found.count, kMaxSolutions);
  for (const Joints& q : found.joints_q) expect_met(chain, q, pose);
}

}  // namespace
}  // namespace corbot::numeric::numeric_inverse_test
