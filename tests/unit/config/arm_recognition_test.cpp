// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>

#include "arm_vectors.h"
#include "config/arms/recognise.h"

namespace corbot::config::arm_recognition_test {
namespace {

using test::arm_vectors;
using testing::HasSubstr;

constexpr double kPi = std::numbers::pi;

struct Named {
  const char* arm;
  const char* family;
};
std::ostream& operator<<(std::ostream& out, const Named& named) { return out << named.arm; }

const auto kArms = testing::Values(
    Named{"al5d", PlanarArm::kName}, Named{"al5d_wr", PlanarArm::kName}, Named{"omx", PlanarArm::kName},
    Named{"px100", PlanarArm::kName}, Named{"so101", PlanarArm::kName},
    Named{"puma560", OrthoParallelArm::kName}, Named{"irb2400", OrthoParallelArm::kName},
    Named{"ur5e", ParallelAxesArm::kName}, Named{"xarm6", OtherArm::kName},
    Named{"scara_cobra600", ScaraArm::kName}, Named{"scara_gx4", ScaraArm::kName},
    Named{"cartesian_ppp", GantryArm::kName}, Named{"cartesian_pppr", GantryArm::kName},
    Named{"cylindrical_rpp", CylindricalArm::kName}, Named{"cylindrical_rppr", CylindricalArm::kName},
    Named{"polar_rrp", PolarArm::kName}, Named{"stanford", PolarArm::kName});

class Recognition : public testing::TestWithParam<Named> {
 protected:
  [[nodiscard]] DhTable table() const { return arm_vectors(GetParam().arm).table; }
  [[nodiscard]] bool is_other() const { return GetParam().family == std::string(OtherArm::kName); }
  [[nodiscard]] bool is_gantry() const { return GetParam().family == std::string(GantryArm::kName); }

  Vector3 vector() { return {normal_(random_), normal_(random_), normal_(random_)}; }
  /// One axis off by this much, in every direction that matters.
  void disturb(JointAxis& axis, double by) {
    const Vector3 tilt = vector();
    axis.direction = axis.direction + (by / norm(tilt)) * tilt;
    axis.direction = (1.0 / norm(axis.direction)) * axis.direction;
    const Vector3 away = vector();
    axis.point_m = axis.point_m + (by / norm(away)) * away;
  }

 private:
  std::mt19937_64 random_{1751};
  std::normal_distribution<double> normal_;
};

TEST_P(Recognition, FindsTheFamily) {
  const RecognisedArm arm = recognise_arm(table());
  EXPECT_STREQ(arm.kinematics.family(), GetParam().family) << arm.reason;
  EXPECT_EQ(arm.reason.empty(), !is_other());
  EXPECT_LT(arm.difference_m, 1e-12);
  EXPECT_LT(arm.difference_rad, 1e-12);
}

TEST_P(Recognition, FindsItInAModifiedTable) {
  // The same arm in Craig's convention: each row takes the link before it, the tool the last one.
  const DhTable standard = table();
  DhTable modified = standard;
  modified.convention = DhConvention::kModified;
  for (std::size_t i = 0; i < standard.count; ++i) {
    modified.rows[i].a_m = i > 0 ? standard.rows[i - 1].a_m : 0.0;
    modified.rows[i].alpha_rad = i > 0 ? standard.rows[i - 1].alpha_rad : 0.0;
  }
  const DhRow& last = standard.rows[standard.count - 1];
  modified.n_T_tool = Pose{{last.a_m, 0.0, 0.0}, about({1.0, 0.0, 0.0}, last.alpha_rad)} * standard.n_T_tool;
  const RecognisedArm arm = recognise_arm(modified);
  EXPECT_STREQ(arm.kinematics.family(), GetParam().family) << arm.reason;
  const Joints q{0.3, -0.2, 0.1, 0.4, -0.5, 0.6};
  EXPECT_LT(norm(arm.kinematics.forward(q).position_m - forward(standard, q).position_m), 1e-12);
}

TEST_P(Recognition, FindsItWithEveryJointTurnedTheOtherWay) {
  JointChain chain = joint_chain(table());
  for (std::size_t i = 0; i < chain.count; ++i) {
    chain.axes[i].direction = -1.0 * chain.axes[i].direction;
    const RecognisedArm arm = recognise_arm(chain);
    EXPECT_STREQ(arm.kinematics.family(), GetParam().family) << "joint " << i + 1 << ": " << arm.reason;
    EXPECT_LT(arm.difference_m, 1e-12);
  }
}

TEST_P(Recognition, FindsItAtAnyPoseThatIsCalledZero) {
  // Other zeros of the joints: the family is a matter of the axes, not of the table's pattern.
  DhTable other = table();
  for (std::size_t i = 0; i < other.count; ++i) {
    DhRow& row = other.rows[i];
    (row.kind == JointKind::kRotary ? row.theta_rad : row.d_m) += 0.37 * static_cast<double>(i + 1);
  }
  const RecognisedArm arm = recognise_arm(other);
  EXPECT_STREQ(arm.kinematics.family(), GetParam().family) << arm.reason;
  EXPECT_LT(arm.difference_m, 1e-12);
}

TEST_P(Recognition, SnapsAMillionth) {
  for (int k = 0; k < 20; ++k) {
    JointChain chain = joint_chain(table());
    for (std::size_t i = 0; i < chain.count; ++i) disturb(chain.axes[i], 1e-6);
    const RecognisedArm arm = recognise_arm(chain);
    ASSERT_STREQ(arm.kinematics.family(), GetParam().family) << arm.reason;
    EXPECT_LT(arm.difference_m, 1e-4);
    EXPECT_LT(arm.difference_rad, 3e-5);
    if (!is_other() && !is_gantry()) {
      EXPECT_GT(arm.difference_rad, 1e-8) << "nothing was snapped";
    }
  }
}

TEST_P(Recognition, DoesNotSnapATenThousandth) {
  if (is_gantry()) GTEST_SKIP() << "slides may stand askew";
  const JointChain exact = joint_chain(table());
  for (std::size_t i = 0; i < exact.count; ++i) {
    JointChain chain = exact;
    disturb(chain.axes[i], 1e-4);
    const RecognisedArm arm = recognise_arm(chain);
    EXPECT_STREQ(arm.kinematics.family(), OtherArm::kName) << "axis " << i + 1;
    EXPECT_THAT(arm.reason, HasSubstr(": ax")) << "axis " << i + 1;
    EXPECT_LT(arm.difference_m, 1e-12) << "as given, not as snapped";
  }
}

INSTANTIATE_TEST_SUITE_P(Arms, Recognition, kArms);

TEST(RecognitionReason, SaysWhatXarm6Lacks) {
  const std::string reason = recognise_arm(arm_vectors("xarm6").table).reason;
  EXPECT_THAT(reason, HasSubstr("spherical wrist: axis 6 passes the crossing of axes 4 and 5 at 0.076 m"));
  EXPECT_THAT(reason, HasSubstr("three parallel axes: axes 3 and 4 are not parallel (90 degrees)"));
}

TEST(RecognitionReason, SaysWhichConditionFailedFirst) {
  const auto reason = [](const char* name, auto&& change) {
    DhTable table = arm_vectors(name).table;
    change(table.rows);
    const RecognisedArm arm = recognise_arm(table);
    EXPECT_STREQ(arm.kinematics.family(), OtherArm::kName) << name;
    return arm.reason;
  };
  EXPECT_THAT(reason("puma560", [](auto& rows) { rows[0].alpha_rad = 1.0; }),
              HasSubstr("axes 1 and 2 are not square to each other (57.2958 degrees)"));
  EXPECT_THAT(reason("puma560", [](auto& rows) { rows[3].a_m = 0.02; }),
              HasSubstr("wrist: axes 4 and 5 do not cross (0.02 m apart)"));
  EXPECT_THAT(reason("ur5e", [](auto& rows) { rows[4].a_m = 0.01; }),
              HasSubstr("three parallel axes: axes 5 and 6 do not cross (0.01 m apart)"));
  EXPECT_THAT(reason("al5d", [](auto& rows) { rows[2].alpha_rad = 0.3; }),
              HasSubstr("axes 3 and 4 are not parallel (17.1887 degrees)"));
  EXPECT_THAT(reason("scara_gx4", [](auto& rows) { rows[1].alpha_rad = 0.1; }),
              HasSubstr("SCARA: axes 1 and 3 are not parallel"));
  EXPECT_THAT(reason("stanford", [](auto& rows) { rows[4].a_m = 0.03; }), HasSubstr("polar: axis"));
  EXPECT_THAT(reason("cylindrical_rpp", [](auto& rows) { rows[1].alpha_rad = 0.5; }),
              HasSubstr("cylindrical: axes 1 and 3 are not square"));
  EXPECT_THAT(reason("cartesian_ppp", [](auto& rows) { rows[0].alpha_rad = 0.0; }), HasSubstr("gantry: "));
  EXPECT_THAT(reason("al5d", [](auto& rows) { rows[1].kind = JointKind::kPrismatic; }),
              HasSubstr("SCARA: axes 1 and 2 are not parallel"));
  EXPECT_THAT(reason("al5d_wr", [](auto& rows) { rows[1].kind = JointKind::kPrismatic; }),
              HasSubstr("no family has joints RPRRR"));
}

TEST(RecognitionSnapping, RestoresAUrdfsRoundedRightAngles) {
  // 1.5708 for a right angle, 3.14159 for two: off by 3.7e-6 and 2.7e-6, again and again.
  for (const char* name : {"so101", "ur5e", "puma560", "al5d_wr", "irb2400"}) {
    const DhTable exact = arm_vectors(name).table;
    DhTable rounded = exact;
    for (std::size_t i = 0; i < rounded.count; ++i) {
      double& alpha = rounded.rows[i].alpha_rad;
      if (std::abs(std::abs(alpha) - kPi / 2) < 1e-9) alpha = std::copysign(1.5708, alpha);
    }
    const RecognisedArm arm = recognise_arm(rounded);
    EXPECT_TRUE(arm.reason.empty()) << name << ": " << arm.reason;
    EXPECT_GT(arm.difference_rad, 1e-6) << name;
    EXPECT_LT(arm.difference_rad, 2e-5) << name;
    const Joints q{0.3, -0.2, 0.1, 0.4, -0.5, 0.6};
    const Pose restored = arm.kinematics.forward(q), meant = forward(exact, q);
    EXPECT_LT(norm(restored.position_m - meant.position_m), 1e-12) << name;
    EXPECT_LT(angle_between(restored.orientation, meant.orientation), 1e-12) << name;
  }
}

}  // namespace
}  // namespace corbot::config::arm_recognition_test
