// SPDX-License-Identifier: Apache-2.0
// Bounds along a stretch of path, for random arms of every family on random parabolas: what is proved holds
// at every sample, and what leaves the workspace is never proved. CORBOT_SEED in the environment sets another
// seed, CORBOT_CASES another number.
#include "corbot/kinematics/path_form.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <iostream>
#include <variant>

#include "corbot/kinematics/planar_stretch.h"
#include "random_arm.h"
#include "support/cases.h"

namespace corbot::property_path_form_test {
namespace {

using test::RandomArm;

/// x(s) = x0 + v·s + a·s²/2 for the position, and a rotation at a constant rate.
struct Parabola {
  Pose start;
  Angles angles;
  TaskRate rate{};
  Vector3 acceleration{};

  [[nodiscard]] TaskRate rate_at(double s) const {
    TaskRate r = rate;
    for (std::size_t i = 0; i < 3; ++i) r[i] += s * acceleration[i];
    return r;
  }
  [[nodiscard]] IkSolution joints_at(const Kinematics& arm, double s, std::uint32_t number,
                                     const Joints& hint) const {
    Pose pose = start;
    for (std::size_t i = 0; i < 3; ++i) pose.position_m[i] += s * (rate[i] + 0.5 * s * acceleration[i]);
    if (arm.follows() != Follows::kFull) {
      return arm.inverse_at(pose.position_m, {angles[0] + s * rate[3], angles[1] + s * rate[4]}, number,
                            hint);
    }
    const Vector3 omega{rate[3], rate[4], rate[5]};
    const double speed = norm(omega);
    if (speed > 0.0) pose.orientation = about((1.0 / speed) * omega, speed * s) * pose.orientation;
    return arm.inverse(pose, number, hint);
  }
};

struct Tally {
  long cells{}, proved{}, small{}, small_proved{}, small_tight{}, left{};
};

/// One cell: nothing that is proved may be wrong.
void check(const Kinematics& arm, RandomArm& random, Tally& tally) {
  Joints q{};
  for (std::size_t i = 0; i < arm.joint_count(); ++i) {
    q[i] = arm.joint_kind(i) == JointKind::kRotary ? random.angle() : random.between(-1.0, 1.0);
  }
  const auto number = arm.solution_of(q);
  ASSERT_TRUE(number.has_value());
  Parabola path{arm.forward(q), arm.followed().at(q)};
  const FollowedAngles followed = arm.followed();
  const std::size_t rows = arm.follows() == Follows::kFull ? 6 : 3 + followed.count;
  for (std::size_t i = 0; i < rows; ++i) path.rate[i] = random.between(-0.5, 0.5);
  if (random.coin())
    path.acceleration = {random.between(-2.0, 2.0), random.between(-2.0, 2.0), random.between(-2.0, 2.0)};
  const double half_width = std::pow(10.0, random.between(-5.0, 0.0));

  TaskRate stray{};
  for (std::size_t i = 0; i < 3; ++i) stray[i] = half_width * std::abs(path.acceleration[i]);
  const PathForm form(arm, q);
  const StretchBound bound = form.bound(path.rate, stray, half_width);
  ++tally.cells;
  tally.proved += bound.is_proved ? 1 : 0;

  bool left = false;
  for (int k = -8; k <= 8; ++k) {
    const double s = half_width * k / 8.0;
    const IkSolution at = path.joints_at(arm, s, *number, q);
    if (at.status != IkStatus::kOk) {
      left = true;
      continue;
    }
    if (!bound.is_proved) continue;
    const StretchBound here = PathForm(arm, at.joints_q).bound(path.rate_at(s), {}, 0.0);
    for (std::size_t i = 0; i < arm.joint_count(); ++i) {
      ASSERT_LE(std::abs(at.joints_q[i] - q[i]), bound.stray_q[i] * (std::abs(k) / 8.0) + 1e-9)
          << "joint " << i << " at " << k << "/8 of " << half_width;
      ASSERT_LE(std::abs(here.rate_middle[i]), bound.rate_bound[i] * (1.0 + 1e-9) + 1e-9)
          << "joint " << i << " at " << k << "/8 of " << half_width;
    }
  }
  ASSERT_FALSE(left && bound.is_proved) << "proved beyond the workspace";
  tally.left += left ? 1 : 0;

  // A cell on which no joint moves by more than a thousandth is proved, and tightly, but next to a
  // singularity.
  const auto size = [](double a, double b) { return std::abs(a) < std::abs(b); };
  const double most = *std::max_element(bound.rate_middle.begin(), bound.rate_middle.end(), size);
  if (form.is_regular() && half_width * std::abs(most) < 1e-3) {
    ++tally.small;
    tally.small_proved += bound.is_proved ? 1 : 0;
    const double bounded = *std::max_element(bound.rate_bound.begin(), bound.rate_bound.end());
    tally.small_tight += bound.is_proved && bounded < 1.05 * std::abs(most) ? 1 : 0;
  }
}

void stretches(const std::function<DhTable(RandomArm&)>& table_of) {
  RandomArm random{std::mt19937_64(test::seed())};
  Tally tally;
  const int cases = test::cases(100'000);
  for (int n = 0; n < cases; n += 20) {
    const Kinematics arm = Kinematics::recognise(joint_chain(table_of(random)));
    ASSERT_GT(arm.solution_count(), 0u);
    for (int k = 0; k < 20; ++k) {
      SCOPED_TRACE(testing::Message() << "arm " << n / 20 << " cell " << k << " " << arm.family());
      check(arm, random, tally);
      if (testing::Test::HasFatalFailure()) return;
    }
  }
  std::cout << tally.cells << " cells, " << tally.proved << " proved; of " << tally.small << " small ones "
            << tally.small_proved << ", within 5 % " << tally.small_tight << "; " << tally.left
            << " left the workspace\n";
  EXPECT_GT(tally.proved, tally.cells / 4);
  EXPECT_GT(tally.small_proved, tally.small * 9 / 10);
  EXPECT_GT(tally.small_tight, tally.small * 8 / 10);
}

TEST(Stretches, OfPlanarArms) {
  stretches([](RandomArm& r) { return r.planar(3 + static_cast<std::uint32_t>(r.random() % 3)); });
}
TEST(Stretches, OfScaras) {
  stretches([](RandomArm& r) { return r.scara(r.coin() ? 3 : 4); });
}
TEST(Stretches, OfGantries) {
  stretches([](RandomArm& r) { return r.gantry(r.coin() ? 3 : 4); });
}
TEST(Stretches, OfCylindricalArms) {
  stretches([](RandomArm& r) { return r.cylindrical(r.coin() ? 3 : 4); });
}
TEST(Stretches, OfOrthoParallelArms) {
  stretches([](RandomArm& r) { return r.ortho_parallel(); });
}
TEST(Stretches, OfArmsWithThreeParallelAxes) {
  stretches([](RandomArm& r) { return r.parallel_axes(); });
}
TEST(Stretches, OfGantriesWithAWrist) {
  stretches([](RandomArm& r) { return r.gantry_with_wrist(); });
}
TEST(Stretches, OfPolarArms) {
  stretches([](RandomArm& r) { return r.polar(r.coin() ? 3 : 6); });
}

/// The closer bounds that a base and planar arm with a wrist has of its own, with tools far off and bases
/// that stand askew.
TEST(Stretches, OfPlanarArmsByTheirOwnBounds) {
  RandomArm random{std::mt19937_64(test::seed())};
  long proved = 0, left = 0;
  const int cases = test::cases(40'000);
  for (int n = 0; n < cases; ++n) {
    Kinematics arm = Kinematics::recognise(joint_chain(random.planar(4)));
    const auto* planar = std::get_if<PlanarArm>(&arm.form());
    ASSERT_NE(planar, nullptr);
    const double across_m = n % 4 == 0 ? random.between(-0.2, 0.2) : 0.0;  // has none of its own, then
    const Pose hand{{random.between(-0.5, 0.5), across_m, random.between(-0.5, 0.5)}, random.rotation()};
    arm.set_frames(random.coin() ? random.frame(3.0) : Pose{}, inverse_of(planar->mount.last_T_n) * hand);
    Joints q{random.angle(), random.angle(), random.angle(), random.angle()};
    if (random.coin()) q[2] *= std::pow(10.0, random.between(-4.0, 0.0));
    const auto number = arm.solution_of(q);
    ASSERT_TRUE(number.has_value());
    Parabola path{arm.forward(q), arm.followed().at(q)};
    for (std::size_t i = 0; i < 4; ++i) path.rate[i] = random.between(-0.5, 0.5);
    if (random.coin())
      path.acceleration = {random.between(-2.0, 2.0), random.between(-2.0, 2.0), random.between(-2.0, 2.0)};
    const double w = std::pow(10.0, random.between(-5.0, 0.0));
    const CellRates cell = cell_rates(arm, q, *number,
                                      {path.start.position_m,
                                       {path.rate[0], path.rate[1], path.rate[2]},
                                       norm(path.acceleration),
                                       path.angles,
                                       {path.rate[3], 0.0, 0.0},
                                       w});
    proved += cell.in_reach ? 1 : 0;
    for (const double side : {-w, w}) {
      Joints hint = q;
      for (int k = 1; k <= 16; ++k) {
        const double s = side * k / 16.0;
        const IkSolution at = path.joints_at(arm, s, *number, hint);
        if (at.status != IkStatus::kOk) {
          ASSERT_FALSE(cell.in_reach) << "case " << n << ": beyond the workspace";
          ++left;
          break;
        }
        hint = at.joints_q;
        const StretchBound here = PathForm(arm, at.joints_q).bound(path.rate_at(s), {}, 0.0);
        for (std::size_t i = 0; i < 4; ++i) {
          if (!std::isfinite(here.rate_middle[i])) continue;
          ASSERT_LE(std::abs(here.rate_middle[i]), cell.rate_bound[i] * (1.0 + 1e-7) + 1e-7)
              << "case " << n << " joint " << i << " at " << k << "/16 of " << side;
        }
      }
    }
  }
  std::cout << proved << " of " << cases << " cells within reach, " << left << " left the workspace\n";
  EXPECT_GT(proved, cases / 4);
  EXPECT_GT(left, cases / 50);
}

}  // namespace
}  // namespace corbot::property_path_form_test
