// SPDX-License-Identifier: Apache-2.0
// Tests which orientations along lines pass the gate, for an arm that follows them and for one that follows
// an angle.
#include <gtest/gtest.h>

#include <numbers>
#include <stdexcept>
#include <variant>
#include <vector>

#include "../../support/test_arms.h"
#include "corbot/motion/path.h"
#include "planner/planner.h"
#include "support/gate.h"

namespace corbot::test::orientation_check_test {
namespace {

constexpr double kTurn = 2.0 * std::numbers::pi;

struct Turning {
  ArmModel arm;
  Joints from;
  Command command{};
  PlannedRate rate;

  Turning(const char* name, const Joints& from_q, const Pose& by) : arm(arm_of(name)), from(from_q) {
    const PlanResult plan =
        Planner(arm).plan({from, 0.0}, {}, MoveRelativeRequest{by, OffsetFrame::kTool, 0.0, true});
    if (const auto* refusal = std::get_if<PlanRefusal>(&plan)) throw std::runtime_error(refusal->text);
    command = std::get<std::vector<Command>>(plan).front();
    rate = plan.rates.front();
  }
  [[nodiscard]] Verdict verdict() const { return gate(arm, command, rate); }
};

Turning puma() {
  return {"puma560", {0.1, 0.2, 0.3, 0.2, 0.3, -0.3}, {{0.01, 0.02, 0.0}, about({0.6, 0.0, 0.8}, 0.3)}};
}
Turning lynx() { return {"lynx5", {0.1, 0.9, 1.2, 0.4}, {{0.0, 0.0, 0.01}, about({0.0, 1.0, 0.0}, 0.1)}}; }

TEST(OrientationCheck, TakesWhatIsPlanned) {
  EXPECT_EQ(puma().verdict(), Verdict::kDone);
  EXPECT_EQ(lynx().verdict(), Verdict::kDone);
}

TEST(OrientationCheck, RefusesAQuaternionThatIsNotOfUnitLength) {
  for (Turning path : {puma(), lynx()}) {
    path.command.line.tool.from.w *= 1.0 + 1e-6;
    path.command.line.tool.from.x *= 1.0 + 1e-6;
    path.command.line.tool.from.y *= 1.0 + 1e-6;
    path.command.line.tool.from.z *= 1.0 + 1e-6;
    EXPECT_EQ(path.verdict(), Verdict::kMalformed);
  }
}

/// All of these end where they should.
TEST(OrientationCheck, RefusesTurnsThatNoPlannerWrites) {
  Turning round = puma();
  Vector3& turn = round.command.line.tool.turn_rad;
  turn = ((norm(turn) + kTurn) / norm(turn)) * turn;
  EXPECT_EQ(round.verdict(), Verdict::kMalformed) << "the long way";

  Turning angled = puma();
  angled.command.line.tool.from_angles_rad[0] = angled.command.line.tool.to_angles_rad[0] = 0.1;
  EXPECT_EQ(angled.verdict(), Verdict::kMalformed) << "angles of an arm that follows none";

  Turning second = lynx();
  second.command.line.tool.from_angles_rad[1] = second.command.line.tool.to_angles_rad[1] = 0.1;
  EXPECT_EQ(second.verdict(), Verdict::kMalformed) << "an angle more than the arm follows";

  Turning far = lynx();
  far.command.line.tool.from_angles_rad[0] += 9.0 * kTurn;
  far.command.line.tool.to_angles_rad[0] += 9.0 * kTurn;
  EXPECT_EQ(far.verdict(), Verdict::kMalformed) << "more turns than joints have";

  Turning turned = lynx();
  turned.command.line.tool.turn_rad = {0.01, 0.0, 0.0};
  EXPECT_EQ(turned.verdict(), Verdict::kMalformed) << "a turn of an arm that follows angles";
}

TEST(OrientationCheck, KeepsEachLimitOfTheRotation) {
  for (const Turning& good : {puma(), lynx()}) {
    for (double PathLimits::*const limit :
         {&PathLimits::rotation_speed_rad_s, &PathLimits::rotation_acceleration_rad_s2,
          &PathLimits::rotation_jerk_rad_s3}) {
      Turning path = good;
      path.arm.path.*limit *= 0.01;
      EXPECT_EQ(path.verdict(), Verdict::kLimit);
    }
  }
}

}  // namespace
}  // namespace corbot::test::orientation_check_test
