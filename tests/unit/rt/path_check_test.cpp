// SPDX-License-Identifier: Apache-2.0
// The arm's kinematics against the path, at every set-point: a plan agrees, and one with a knot that is
// altered by a hair does not.
#include "rt/cycle/path_check.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <stdexcept>
#include <string>
#include <variant>
#include <vector>

#include "../../support/arm_motions.h"
#include "../../support/test_arms.h"
#include "corbot/motion/rate_knots.h"
#include "planner/planner.h"

namespace corbot::test::path_check_test {
namespace {

class Agreement : public testing::TestWithParam<const char*> {
 protected:
  void SetUp() override {
    const ArmMotions motions = motions_of(arm_, 0.05);
    ASSERT_TRUE(motions.line_to_m);
    const PlanResult plan =
        Planner(arm_).move_s({motions.there_q, 0.0}, motions.settings, *motions.line_to_m, 0.0);
    line_ = std::get<std::vector<Command>>(plan).front().line;
    knots_ = plan.rates.front().knots;
  }
  /// At every point of the path.
  [[nodiscard]] bool agrees(const std::vector<rate::Knot>& knots, const Kinematics& arm) const {
    constexpr int kPoints = 400;
    rt::PathCheck check;
    check.begin(line_.solution);
    for (int i = 0; i <= kPoints; ++i) {
      const rate::State z = rate::state_at(knots, knots.back().lambda_s * i / kPoints);
      Joints q{};
      std::copy_n(z.begin(), q.size(), q.begin());
      if (!check.agrees(arm, point_at(line_, z[rate::kPath]), q)) return false;
    }
    return true;
  }

  ArmModel arm_ = arm_of(GetParam());
  LineMotion line_{};
  std::vector<rate::Knot> knots_;
};

TEST_P(Agreement, IsThereForAPlan) { EXPECT_TRUE(agrees(knots_, arm_.kinematics)); }

TEST_P(Agreement, IsBrokenByEveryAlteredKnot) {
  for (std::size_t k = 0; k < knots_.size(); ++k) {
    for (std::size_t i = 0; i < arm_.dof; ++i) {
      SCOPED_TRACE(testing::Message() << "knot " << k << ", joint " << i);
      std::vector<rate::Knot> place = knots_, rate = knots_;
      place[k].z[i] += 2e-4;
      rate[k].rate[i] += 0.3;
      EXPECT_FALSE(agrees(place, arm_.kinematics));
      EXPECT_FALSE(agrees(rate, arm_.kinematics));
    }
  }
}

TEST_P(Agreement, IsBrokenByAnotherTool) {
  Kinematics other = arm_.kinematics;
  Pose tool = other.chain().n_T_tool;
  tool.position_m[0] += 1e-5;
  other.set_frames(other.chain().base_T_0, tool);
  EXPECT_FALSE(agrees(knots_, other));
}

INSTANTIATE_TEST_SUITE_P(Arms, Agreement,
                         testing::Values("lynx5", "al5d_wr", "puma560", "scara_gx4", "stanford",
                                         "cartesian_ppp", "cylindrical_rpp", "polar_rrp", "xarm6"),
                         [](const auto& arm) { return std::string(arm.param); });

/// The forward kinematics see nothing of joints that a family's inverse would never give; here a table of its
/// own inverse that is off.
TEST(PathCheck, ComparesTheInverseAwayFromSingularities) {
  const ArmModel arm = arm_of("puma560");
  const Joints q{0.3, -0.8, 0.4, 0.2, 0.3, 0.1};
  PathPoint point{};
  const Pose there = arm.kinematics.forward(q);
  point.position_m = there.position_m;
  point.orientation = there.orientation;
  rt::PathCheck check;
  for (std::uint32_t number = 0; arm.kinematics.has_solution(number); ++number) {
    check.begin(number);
    EXPECT_TRUE(check.agrees(arm.kinematics, point, q)) << "it goes on on another solution: " << number;
  }
  Joints turned = q;
  turned[5] += 1e-5;
  EXPECT_FALSE(check.agrees(arm.kinematics, point, turned));
}

}  // namespace
}  // namespace corbot::test::path_check_test
