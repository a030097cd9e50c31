// SPDX-License-Identifier: Apache-2.0
// The profiles of the arms of tests/vectors/arms, against those vectors.
#include <gtest/gtest.h>
#include <Eigen/Dense>

#include <cmath>
#include <filesystem>
#include <numbers>
#include <set>
#include <string>

#include "arm_vectors.h"
#include "config/arms/arm_kind.h"
#include "config/load_profile.h"
#include "planner/numeric/numeric_inverse.h"
#include "support/paths.h"

namespace corbot::shipped_arms_test {
namespace {

using config::GeometryForm;
using test::arm_vectors;
using test::ArmVectors;
using test::CsvRow;
using test::read_csv;

struct Shipped {
  const char* arm;
  const char* family;
  ArmKind kind;
};
std::ostream& operator<<(std::ostream& out, const Shipped& shipped) { return out << shipped.arm; }

const std::vector<Shipped> kArms{{"al5d", PlanarArm::kName, ArmKind::kAnthropomorphic},
                                 {"al5d_wr", PlanarArm::kName, ArmKind::kAnthropomorphic},
                                 {"omx", PlanarArm::kName, ArmKind::kAnthropomorphic},
                                 {"px100", PlanarArm::kName, ArmKind::kAnthropomorphic},
                                 {"so101", PlanarArm::kName, ArmKind::kAnthropomorphic},
                                 {"puma560", OrthoParallelArm::kName, ArmKind::kAnthropomorphic},
                                 {"irb2400", OrthoParallelArm::kName, ArmKind::kAnthropomorphic},
                                 {"ur5e", ParallelAxesArm::kName, ArmKind::kAnthropomorphic},
                                 {"xarm6", OtherArm::kName, ArmKind::kOther},
                                 {"scara_cobra600", ScaraArm::kName, ArmKind::kScara},
                                 {"scara_gx4", ScaraArm::kName, ArmKind::kScara},
                                 {"cartesian_ppp", GantryArm::kName, ArmKind::kCartesian},
                                 {"cartesian_pppr", GantryArm::kName, ArmKind::kCartesian},
                                 {"cylindrical_rpp", CylindricalArm::kName, ArmKind::kCylindrical},
                                 {"cylindrical_rppr", CylindricalArm::kName, ArmKind::kCylindrical},
                                 {"polar_rrp", PolarArm::kName, ArmKind::kPolar},
                                 {"stanford", PolarArm::kName, ArmKind::kPolar}};

double distance_m(const Pose& a, const Pose& b) { return norm(a.position_m - b.position_m); }
double rotation_rad(const Pose& a, const Pose& b) { return angle_between(a.orientation, b.orientation); }

class ShippedArms : public testing::TestWithParam<Shipped> {
 protected:
  ShippedArms()
      : vectors_(arm_vectors(GetParam().arm)),
        profile_(load_profile(std::string(CORBOT_PROFILES) + "/" + GetParam().arm + ".toml")),
        arm_(profile_.arm.kinematics) {
    // The paper's table ends at the hand's joint; the vectors' tool frame differs by its orientation.
    if (profile_.description.form == GeometryForm::kLengths)
      arm_.set_frames(vectors_.table.base_T_0, vectors_.table.n_T_tool);
  }

  [[nodiscard]] std::vector<CsvRow> rows(const char* what = "") const {
    return read_csv(std::string(GetParam().arm) + what + ".csv");
  }
  /// Joint values of a row, which has table values.
  [[nodiscard]] Joints joints(const CsvRow& row) const {
    Joints q = test::joints(row, profile_.arm.dof);
    for (std::size_t i = 0; i < profile_.arm.dof; ++i) q[i] -= profile_.description.home_q[i];
    return q;
  }

  /// An arm without a closed form, from a hint beside the row's joints.
  void expect_numeric_solutions() {
    for (const CsvRow& row : rows()) {
      Joints q = joints(row);
      for (double& value : q) value += 0.05;
      const auto found = numeric::first_solution(arm_.chain(), test::pose(row), q, {});
      ASSERT_EQ(found.count, 1u) << row.at("case");
      const Pose back = arm_.forward(found.joints_q[0]);
      ASSERT_LT(distance_m(back, test::pose(row)), 1e-9) << row.at("case");
      ASSERT_LT(rotation_rad(back, test::pose(row)), 1e-9) << row.at("case");
    }
  }

  ArmVectors vectors_;
  Profile profile_;
  Kinematics arm_;
};

TEST_P(ShippedArms, AreRecognisedAndVerified) {
  EXPECT_EQ(profile_.name, GetParam().arm);
  EXPECT_STREQ(arm_.family(), GetParam().family);
  EXPECT_EQ(profile_.arm.kind, GetParam().kind);
  EXPECT_EQ(profile_.arm.dof, vectors_.table.count);
  EXPECT_EQ(profile_.joint_names.size(), vectors_.table.count);
  EXPECT_EQ(profile_.description.reason.empty(), GetParam().kind != ArmKind::kOther)
      << profile_.description.reason;
  EXPECT_LT(profile_.description.difference_m, 1e-12);
  EXPECT_LT(profile_.description.difference_rad, 1e-12);
  EXPECT_EQ(profile_.backend.kind, "loopback");
}

TEST_P(ShippedArms, HaveTheRangesOfTheVectors) {
  for (std::size_t i = 0; i < profile_.arm.dof; ++i) {
    const JointLimits& limits = profile_.arm.joints[i];
    EXPECT_NEAR(limits.lower_q + profile_.description.home_q[i], vectors_.lower_q[i], 1e-9) << "joint " << i;
    EXPECT_NEAR(limits.upper_q + profile_.description.home_q[i], vectors_.upper_q[i], 1e-9) << "joint " << i;
  }
}

TEST_P(ShippedArms, GoForwardToEveryRow) {
  for (const CsvRow& row : rows()) {
    const Pose pose = arm_.forward(joints(row));
    ASSERT_LT(distance_m(pose, test::pose(row)), 1e-12);
    ASSERT_LT(rotation_rad(pose, test::pose(row)), 1e-12);
  }
}

TEST_P(ShippedArms, ComeBackOnEveryRow) {
  if (arm_.solution_count() == 0) {
    expect_numeric_solutions();
    return;
  }
  const double limit_rad = arm_.follows() == Follows::kNone ? std::numbers::pi : 1e-9;
  for (const CsvRow& row : rows()) {
    const Joints q = joints(row);
    const SolutionSet set = arm_.solutions(test::pose(row), q, limit_rad);
    ASSERT_GT(set.count, 0u) << row.at("case");
    for (const auto& [number, solution] : set) {
      const Pose back = arm_.forward(solution.joints_q);
      ASSERT_LT(distance_m(back, test::pose(row)), 1e-9) << row.at("case") << " " << number;
      if (arm_.follows() != Follows::kNone) {
        ASSERT_LT(rotation_rad(back, test::pose(row)), 1e-9) << row.at("case") << " " << number;
      }
    }
  }
}

/// Limits, home and ranges together: as many solutions within the profile's ranges as the vectors have within
/// theirs.
TEST_P(ShippedArms, HaveAsManySolutionsInTheirRanges) {
  if (arm_.solution_count() == 0) return;  // ComeBackOnEveryRow has them
  Joints lower_q{}, upper_q{};
  for (std::size_t i = 0; i < profile_.arm.dof; ++i) {
    lower_q[i] = profile_.arm.joints[i].lower_q;
    upper_q[i] = profile_.arm.joints[i].upper_q;
  }
  for (const CsvRow& row : rows("_ik_counts")) {
    if (row.at("task") == "direction5") continue;
    std::size_t in_ranges = 0;
    for (const auto& [number, solution] : arm_.solutions(test::pose(row), {}, std::numbers::pi)) {
      if (row.at("task") == "pose6" && solution.orientation_error_rad > 1e-9) continue;
      in_ranges += arm_.within(lower_q, upper_q, 1e-8, solution.joints_q, {}) ? 1 : 0;
    }
    EXPECT_EQ(in_ranges, static_cast<std::size_t>(test::number(row, "in_limits"))) << row.at("pose");
  }
}

/// Smallest singular value of the path's Jacobian (m and rad): 0 at a singularity.
double regularity(const Kinematics& arm, const Joints& q) {
  const Jacobian jacobian = arm.jacobian(q);
  const FollowedAngles followed = arm.followed();
  const bool follows_all = arm.follows() == Follows::kFull;
  const auto n = static_cast<Eigen::Index>(arm.joint_count());
  Eigen::MatrixXd task = Eigen::MatrixXd::Zero(n, n);
  for (Eigen::Index k = 0; k < n; ++k) {
    const auto row = static_cast<std::size_t>(k);
    for (Eigen::Index i = 0; i < n; ++i) {
      const auto column = static_cast<std::size_t>(i);
      task(k, i) = row < 3 || follows_all ? jacobian[row][column] : followed.rows[row - 3][column];
    }
  }
  return Eigen::JacobiSVD<Eigen::MatrixXd>(task).singularValues()(n - 1);
}

/// A line can be begun where Ready goes. But for the paper's own arm, which Ready stretches.
TEST_P(ShippedArms, AreFarFromSingularAtReady) {
  const double regular = regularity(arm_, {});
  if (profile_.description.form == GeometryForm::kLengths) {
    EXPECT_LT(regular, 1e-9);
  } else {
    EXPECT_GT(regular, 0.02);
  }
}

TEST_P(ShippedArms, HaveSimulatedServosThatCoverTheirRanges) {
  std::set<std::uint32_t> channels{profile_.arm.gripper.channel};
  for (std::size_t i = 0; i < profile_.arm.dof; ++i) {
    const ServoMap& servo = profile_.arm.servos[i];
    const JointLimits& limits = profile_.arm.joints[i];
    EXPECT_TRUE(channels.insert(servo.channel).second) << "joint " << i;
    for (const double q : {limits.lower_q, limits.upper_q}) {
      const double pulse_us = servo.zero_us + servo.direction * servo.us_per_q * q;
      EXPECT_GE(pulse_us, servo.pulse_min_us - 1e-6) << "joint " << i;
      EXPECT_LE(pulse_us, servo.pulse_max_us + 1e-6) << "joint " << i;
    }
    if (!profile_.has_servo[i]) {
      EXPECT_LE(servo.us_per_q * limits.speed_q_s, profile_.backend.loopback.rate_us_per_s) << "joint " << i;
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Profiles, ShippedArms, testing::ValuesIn(kArms),
                         [](const auto& arm) { return std::string(arm.param.arm); });

TEST(ShippedProfiles, AreAllLoaded) {
  std::set<std::string> tested{"lynx5", "lynx5-can"};
  for (const Shipped& arm : kArms) tested.insert(arm.arm);
  for (const auto& file : std::filesystem::directory_iterator(CORBOT_PROFILES)) {
    if (file.path().extension() != ".toml") continue;
    EXPECT_EQ(tested.count(file.path().stem().string()), 1u) << file.path();
    EXPECT_NO_THROW((void)load_profile(file.path())) << file.path();
  }
}

}  // namespace
}  // namespace corbot::shipped_arms_test
