// SPDX-License-Identifier: Apache-2.0
// Every row of tests/vectors/arms, by every family.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "arm_vectors.h"
#include "corbot/kinematics/arm_kinematics.h"

namespace corbot::arm_vectors_test {
namespace {

using test::arm_vectors;
using test::ArmVectors;
using test::CsvRow;
using test::joints;
using test::read_csv;

struct Named {
  const char* arm;
  const char* family;
};
std::ostream& operator<<(std::ostream& out, const Named& named) { return out << named.arm; }

double distance_m(const Pose& a, const Pose& b) { return norm(a.position_m - b.position_m); }
double rotation_rad(const Pose& a, const Pose& b) { return angle_between(a.orientation, b.orientation); }

/// Modulo whole turns.
double apart(const Kinematics& arm, const Joints& a, const Joints& b) {
  double worst = 0.0;
  for (std::size_t i = 0; i < arm.joint_count(); ++i) {
    const bool turns = arm.joint_kind(i) == JointKind::kRotary;
    worst = std::max(worst, std::abs(turns ? wrap_angle(a[i] - b[i]) : a[i] - b[i]));
  }
  return worst;
}

class Tables : public testing::TestWithParam<const char*> {};

TEST_P(Tables, GiveTheSamePosesAsTheMatricesAndTheVectors) {
  const DhTable table = arm_vectors(GetParam()).table;
  const JointChain chain = joint_chain(table);
  for (const CsvRow& row : read_csv(std::string(GetParam()) + ".csv")) {
    const Joints q = joints(row, table.count);
    const Pose expected = test::pose(row);
    for (const Pose& pose : {forward(table, q), forward(chain, q)}) {
      ASSERT_LT(distance_m(pose, expected), 1e-12);
      ASSERT_LT(rotation_rad(pose, expected), 1e-12);
    }
  }
}

TEST_P(Tables, HaveTheJacobianOfTheirMatrices) {
  const DhTable table = arm_vectors(GetParam()).table;
  const JointChain chain = joint_chain(table);
  const double h = 1e-6;
  const std::vector<CsvRow> rows = read_csv(std::string(GetParam()) + ".csv");
  for (std::size_t k = 0; k < rows.size(); k += 10) {
    const Joints q = joints(rows[k], table.count);
    const Jacobian j = jacobian(chain, q);
    for (std::size_t i = 0; i < table.count; ++i) {
      Joints more = q, less = q;
      more[i] += h;
      less[i] -= h;
      const Pose a = forward(table, less), b = forward(table, more);
      const Vector3 linear = (0.5 / h) * (b.position_m - a.position_m);
      const Quaternion d = b.orientation * conjugate(a.orientation);
      const double sign = d.w < 0.0 ? -1.0 : 1.0;
      const Vector3 angular = (sign / h) * Vector3{d.x, d.y, d.z};
      for (std::size_t n = 0; n < 3; ++n) {
        ASSERT_NEAR(j[n][i], linear[n], 1e-8) << "joint " << i;
        ASSERT_NEAR(j[n + 3][i], angular[n], 1e-8) << "joint " << i;
      }
    }
    for (std::size_t i = table.count; i < kMaxJoints; ++i) {
      for (std::size_t n = 0; n < 6; ++n) ASSERT_EQ(j[n][i], 0.0);
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Arms, Tables,
                         testing::Values("al5d", "al5d_wr", "omx", "px100", "so101", "puma560", "irb2400",
                                         "ur5e", "xarm6", "scara_cobra600", "scara_gx4", "cartesian_ppp",
                                         "cartesian_pppr", "cylindrical_rpp", "cylindrical_rppr", "polar_rrp",
                                         "stanford"));

class Arms : public testing::TestWithParam<Named> {
 protected:
  Arms() : vectors_(arm_vectors(GetParam().arm)), arm_(Kinematics::recognise(joint_chain(vectors_.table))) {}

  [[nodiscard]] std::string file(const char* what) const {
    return std::string(GetParam().arm) + what + ".csv";
  }

  /// Joint vectors within the limits that are these by whole turns.
  [[nodiscard]] std::size_t turns_within_limits(const Joints& q) const {
    std::size_t all = 1;
    for (std::size_t i = 0; i < arm_.joint_count(); ++i) {
      if (arm_.joint_kind(i) == JointKind::kPrismatic) continue;
      std::size_t turns = 0;
      for (int k = -4; k <= 4; ++k) {
        const double turned = q[i] + 2.0 * std::numbers::pi * k;
        turns += turned >= vectors_.lower_q[i] - 1e-9 && turned <= vectors_.upper_q[i] + 1e-9 ? 1 : 0;
      }
      all *= turns;
    }
    return all;
  }

  ArmVectors vectors_;
  Kinematics arm_;
};

TEST_P(Arms, AreRecognised) {
  EXPECT_STREQ(arm_.family(), GetParam().family);
  EXPECT_EQ(arm_.joint_count(), vectors_.table.count);
  EXPECT_FALSE(arm_.has_solution(arm_.solution_count()));
}

TEST_P(Arms, GoForwardToEveryRow) {
  for (const CsvRow& row : read_csv(file(""))) {
    const Pose pose = arm_.forward(joints(row, arm_.joint_count()));
    ASSERT_LT(distance_m(pose, test::pose(row)), 1e-12);
    ASSERT_LT(rotation_rad(pose, test::pose(row)), 1e-12);
  }
}

TEST_P(Arms, ComeBackOnEveryRow) {
  for (const CsvRow& row : read_csv(file(""))) {
    const Joints q = joints(row, arm_.joint_count());
    const Pose pose = test::pose(row);
    const SolutionSet set =
        arm_.solutions(pose, q, arm_.follows() == Follows::kNone ? std::numbers::pi : 1e-9);
    ASSERT_GT(set.count, 0u) << row.at("case");
    // Borders and what is next to them lose half of the digits of an angle, not of a pose.
    const bool plain = row.at("case") == "random";
    double nearest = 10.0;
    for (const auto& [number, solution] : set) {
      const Pose back = arm_.forward(solution.joints_q);
      ASSERT_LT(distance_m(back, pose), plain ? 1e-12 : 1e-9) << row.at("case") << " " << number;
      if (arm_.follows() != Follows::kNone) {
        ASSERT_LT(rotation_rad(back, pose), plain ? 1e-12 : 1e-9) << row.at("case") << " " << number;
      }
      ASSERT_NEAR(rotation_rad(back, pose), solution.orientation_error_rad, 1e-12);
      nearest = std::min(nearest, apart(arm_, solution.joints_q, q));
    }
    if (plain) {
      ASSERT_LT(nearest, 1e-9);
    }
  }
}

TEST_P(Arms, FindEverySolutionAndInventNone) {
  std::map<std::string, std::vector<Joints>> expected;
  for (const CsvRow& row : read_csv(file("_ik_solutions"))) {
    expected[row.at("pose") + row.at("task")].push_back(joints(row, arm_.joint_count()));
  }
  for (const CsvRow& row : read_csv(file("_ik_counts"))) {
    const Pose pose = test::pose(row);
    const std::string task = row.at("task");
    const std::vector<Joints>& all = expected[row.at("pose") + task];
    ASSERT_EQ(all.size(), static_cast<std::size_t>(test::number(row, "branches")));
    std::size_t found = 0, in_limits = 0, with_turns = 0;
    for (const NumberedSolution& entry : arm_.solutions(pose, {}, std::numbers::pi)) {
      const IkSolution& solution = entry.solution;
      const Pose back = arm_.forward(solution.joints_q);
      ASSERT_LT(distance_m(back, pose), 1e-9);
      if (task == "pose6" && solution.orientation_error_rad > 1e-9) continue;
      const Vector3 x{1.0, 0.0, 0.0};
      if (task == "direction5" && norm(rotate(back.orientation, x) - rotate(pose.orientation, x)) > 1e-9) {
        continue;
      }
      ++found;
      const auto near = arm_.within(vectors_.lower_q, vectors_.upper_q, 1e-9, solution.joints_q, {});
      in_limits += near ? 1 : 0;
      with_turns += near ? turns_within_limits(*near) : 0;
      const bool known = std::any_of(
          all.begin(), all.end(), [&](const Joints& q) { return apart(arm_, solution.joints_q, q) < 1e-8; });
      EXPECT_TRUE(known) << "pose " << row.at("pose") << " " << task << ": solution " << entry.number
                         << " is invented";
    }
    EXPECT_EQ(in_limits, static_cast<std::size_t>(test::number(row, "in_limits")));
    EXPECT_EQ(with_turns, static_cast<std::size_t>(test::number(row, "in_limits_with_turns")));
    EXPECT_EQ(found, all.size()) << "pose " << row.at("pose") << " " << task << " " << row.at("kind");
  }
}

TEST_P(Arms, SayOnWhichSolutionTheirJointsLie) {
  std::size_t looked_at = 0;
  for (const CsvRow& row : read_csv(file("_ik_solutions"))) {
    const Joints q = joints(row, arm_.joint_count());
    const auto number = arm_.solution_of(q);
    ASSERT_TRUE(number.has_value());
    ASSERT_LT(apart(arm_, arm_.inverse(arm_.forward(q), *number, q).joints_q, q), 2e-7);
    ++looked_at;
  }
  EXPECT_GT(looked_at, 10u);
}

TEST_P(Arms, ComeBackByTheAnglesThatTheyFollow) {
  const FollowedAngles followed = arm_.followed();
  const bool full = arm_.follows() == Follows::kFull;
  EXPECT_EQ(full ? 6u : followed.count + 3u, arm_.joint_count());
  for (const CsvRow& row : read_csv(file(""))) {
    if (row.at("case") != "random") continue;
    const Joints q = joints(row, arm_.joint_count());
    const auto number = arm_.solution_of(q);
    ASSERT_TRUE(number.has_value());
    const IkSolution solution = arm_.inverse_at(test::pose(row).position_m, followed.at(q), *number, q);
    ASSERT_EQ(solution.status, full ? IkStatus::kNoSolution : IkStatus::kOk);
    if (!full) {
      ASSERT_LT(apart(arm_, solution.joints_q, q), 1e-9);
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Planar, Arms,
                         testing::Values(Named{"al5d", PlanarArm::kName}, Named{"al5d_wr", PlanarArm::kName},
                                         Named{"omx", PlanarArm::kName}, Named{"px100", PlanarArm::kName},
                                         Named{"so101", PlanarArm::kName}));
INSTANTIATE_TEST_SUITE_P(Scara, Arms,
                         testing::Values(Named{"scara_cobra600", ScaraArm::kName},
                                         Named{"scara_gx4", ScaraArm::kName}));
INSTANTIATE_TEST_SUITE_P(Sliding, Arms,
                         testing::Values(Named{"cartesian_ppp", GantryArm::kName},
                                         Named{"cartesian_pppr", GantryArm::kName},
                                         Named{"cylindrical_rpp", CylindricalArm::kName},
                                         Named{"cylindrical_rppr", CylindricalArm::kName},
                                         Named{"polar_rrp", PolarArm::kName},
                                         Named{"stanford", PolarArm::kName}));

INSTANTIATE_TEST_SUITE_P(SixAxes, Arms,
                         testing::Values(Named{"puma560", OrthoParallelArm::kName},
                                         Named{"irb2400", OrthoParallelArm::kName},
                                         Named{"ur5e", ParallelAxesArm::kName}));

struct Projected {
  const char* arm;
  double bar_rad;
};
class Projections : public testing::TestWithParam<Projected> {};

/// An orientation that the arm cannot take: the smallest error over all solutions is that of a numeric
/// optimum.
TEST_P(Projections, HaveTheSmallestError) {
  const Kinematics arm = Kinematics::recognise(joint_chain(arm_vectors(GetParam().arm).table));
  for (const CsvRow& row : read_csv(std::string(GetParam().arm) + "_projection.csv")) {
    const Pose wanted = test::pose(row);
    double best_rad = 10.0;
    for (const auto& [number, solution] : arm.solutions(wanted, {}, std::numbers::pi)) {
      const Pose back = arm.forward(solution.joints_q);
      ASSERT_LT(distance_m(back, wanted), 1e-12);
      ASSERT_NEAR(rotation_rad(back, wanted), solution.orientation_error_rad, 1e-12) << number;
      best_rad = std::min(best_rad, solution.orientation_error_rad);
    }
    EXPECT_NEAR(best_rad, test::number(row, "error_rad"), GetParam().bar_rad);
  }
}

INSTANTIATE_TEST_SUITE_P(Arms, Projections,
                         testing::Values(Projected{"al5d_wr", 1e-9}, Projected{"omx", 1e-9},
                                         Projected{"so101", 2.5e-3}));

}  // namespace
}  // namespace corbot::arm_vectors_test
