// SPDX-License-Identifier: Apache-2.0
// Ranges of joints along a path, between knots and at them; and what the planner says of lines that leave
// them on the way.
#include "planner/rate/ranges.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <optional>
#include <variant>
#include <vector>

#include "planner/planner.h"
#include "test_arm.h"

namespace corbot::rate_ranges_test {
namespace {

using rate::find_breach;
using rate::Knot;
using rate::RangeBreach;
using test::deg;
using testing::HasSubstr;

/// Joint 1 goes out and back again: 4 t (1 − t) · 0.3, so up to 0.3 in the middle, and 0 at each knot.
std::vector<Knot> bulge() {
  std::vector<Knot> knots(3);
  for (std::size_t k = 0; k < knots.size(); ++k) knots[k].lambda_s = static_cast<double>(k);
  knots[1].rate[1] = 1.2;
  knots[2].rate[1] = -1.2;
  knots[1].bend[1] = knots[2].bend[1] = -2.4;
  knots[0].rate[1] = 0.0;
  return knots;
}

std::array<JointLimits, kMaxJoints> up_to(double upper_q) {
  std::array<JointLimits, kMaxJoints> limits{};
  for (JointLimits& limit : limits) {
    limit.lower_q = -1.0;
    limit.upper_q = upper_q;
  }
  return limits;
}

TEST(RateRanges, AreLookedAtBetweenTheKnots) {
  EXPECT_FALSE(find_breach(bulge(), 4, up_to(0.3)));
  EXPECT_FALSE(find_breach(bulge(), 4, up_to(0.3 - 0.9e-7))) << "within the tolerance";
  for (const double upper_q : {0.3 - 1.2e-7, 0.29, 0.1}) {
    const std::optional<RangeBreach> breach = find_breach(bulge(), 4, up_to(upper_q));
    ASSERT_TRUE(breach) << upper_q;
    EXPECT_EQ(breach->joint, 1u);
    EXPECT_GT(breach->position_q, upper_q);
    EXPECT_GT(breach->lambda_s, 1.0);
    EXPECT_LT(breach->lambda_s, 2.0);
  }
  EXPECT_FALSE(find_breach(bulge(), 1, up_to(0.1))) << "of an arm without this joint";
}

TEST(RateRanges, CountAtTheKnots) {
  std::vector<Knot> knots = bulge();
  knots[0].z[0] = 0.5;
  const std::optional<RangeBreach> breach = find_breach(knots, 4, up_to(0.4));
  ASSERT_TRUE(breach);
  EXPECT_EQ(breach->joint, 0u);
  EXPECT_EQ(breach->lambda_s, 0.0);
}

/// The middle of the line is nearer to the base than its ends: the elbow bends further there.
TEST(RateRanges, AnEndInsideDoesNotHideAWayOutside) {
  const Planner planner(test::lynx5());
  const PlanStart left{{deg(40.0), deg(40), deg(60), deg(55), 0.0, 0.0}, 0.0};
  const std::array<double, 3> from = test::tcp_of(test::lynx5(), left.position_q);
  PlanSettings settings;
  settings.soft_limits.emplace();
  for (std::size_t i = 0; i < 4; ++i) {
    settings.soft_limits->lower_q[i] = test::lynx5().joints[i].lower_q;
    settings.soft_limits->upper_q[i] = i == 2 ? deg(61.0) : test::lynx5().joints[i].upper_q;
  }
  ASSERT_TRUE(std::holds_alternative<std::vector<Command>>(
      planner.move_s(left, {}, {from[0], -from[1], from[2]}, 0.0)));
  const PlanResult limited = planner.move_s(left, settings, {from[0], -from[1], from[2]}, 0.0);
  ASSERT_TRUE(std::holds_alternative<PlanRefusal>(limited));
  const auto& refusal = std::get<PlanRefusal>(limited);
  EXPECT_EQ(refusal.joint, 2);
  EXPECT_GT(refusal.value, deg(61.0));
  EXPECT_NEAR(refusal.target_m[0], from[0], 1e-6);
  EXPECT_THAT(refusal.text, HasSubstr("% along the path"));
}

/// Through the base axis, where the shoulder cannot fold back; and out of reach on the way.
TEST(RateRanges, TheProofNamesWhatIsInTheWay) {
  const Planner planner(test::lynx5());
  const PlanStart ahead{{0.0, deg(40), deg(60), deg(55), 0.0, 0.0}, 0.0};
  const std::array<double, 3> from = test::tcp_of(test::lynx5(), ahead.position_q);
  const PlanResult through = planner.move_s(ahead, {}, {-from[0], 0.0, from[2]}, 0.0);
  ASSERT_TRUE(std::holds_alternative<PlanRefusal>(through));
  EXPECT_GE(std::get<PlanRefusal>(through).joint, 0) << std::get<PlanRefusal>(through).text;
  const PlanResult beyond = planner.move_s(ahead, {}, {0.5, 0.1, 0.1}, 0.0);
  ASSERT_TRUE(std::holds_alternative<PlanRefusal>(beyond));
  EXPECT_THAT(std::get<PlanRefusal>(beyond).text, HasSubstr("the target"));
}

}  // namespace
}  // namespace corbot::rate_ranges_test
