// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>

#include <sstream>

#include "soak/judge_fixture.h"
#include "soak/kept.h"

namespace corbot::soak {
namespace {

using testing::Contains;
using testing::HasSubstr;
using testing::IsEmpty;

TEST_F(Judge, FindsNothingInAGoodRun) {
  call("StartDrive", 401, "ok", 1);
  move(1, sign_degrees(10, 401));
  begin_drive("Drive", 402, -sign_degrees(12, 402));
  move(2, -sign_degrees(12, 402));
  call("Stop", 0);
  const Verdict found = verdict();
  EXPECT_THAT(found.faults, IsEmpty());
  EXPECT_EQ(found.whole_motions, 2);
}

TEST_F(Judge, JudgesAgainWhatWasKept) {
  const Break broken{{7, 9}, "freeze client", 3};
  const Clear clear{{11, 12}, "141 gap\n133 held", false};
  std::string text =
      "0 cycle,time_ns\n# for a reader\n2 begin 1 5 Stop 0 0\nc begin 1 6 corbot-stop 0 0\nc end 1 8 ok 0\n";
  write_circumstances({profile_, ledger_, recording_, {broken}, {{1, 2}}, {clear}, {{4, 0.8}}},
                      [&](const std::string& line) { text += line + "\n"; });
  std::istringstream stream(text);
  Kept kept(profile_);
  kept.read(stream);
  ASSERT_EQ(kept.ledger.calls().size(), 2u);
  EXPECT_EQ(kept.ledger.calls()[0].client, 2);
  EXPECT_EQ(kept.ledger.calls()[1].operation, kLocalStop);
  ASSERT_EQ(kept.breaks.size(), 1u);
  EXPECT_EQ(kept.breaks[0].what, "freeze client");
  EXPECT_EQ(kept.breaks[0].client, 3);
  ASSERT_EQ(kept.clears.size(), 1u);
  EXPECT_EQ(kept.clears[0].cause, clear.cause);
  EXPECT_FALSE(kept.clears[0].done);
  EXPECT_EQ(kept.stalls.at(0).end_ns, 2);
  EXPECT_EQ(kept.restarts.at(0).back_off_s, 0.8);
}

TEST_F(Judge, SeesAMotionThatIsCarriedOutTwice) {
  call("Drive", 401, "COMM_FAILURE/2");
  move(1, sign_degrees(10, 401));
  move(2, sign_degrees(10, 401));
  EXPECT_THAT(faults(), Contains(HasSubstr("carried out twice")));
}

TEST_F(Judge, TellsCallsApartWhoseSignaturesComeRoundAgain) {
  call("StartDrive", 401, "ok", 1);
  move(1, sign_degrees(10, 401));
  call("StartDrive", 401, "ok", 2);
  move(2, sign_degrees(10, 401));
  EXPECT_THAT(faults(), IsEmpty());
  move(3, sign_degrees(10, 401));
  EXPECT_THAT(faults(), Contains(HasSubstr("carried out twice")));
}

TEST_F(Judge, TakesNoSumOfSignaturesForAnothers) {
  begin("StartMoveJoints", 1232, "0 0 0 0");
  call("StartDrive", 401, "ok", 1);
  move(1, sign_degrees(10, 401));
  call("StartDrive", 831, "ok", 2);
  move(2, sign_degrees(10, 831));  // and stands where signature 1232 would
  EXPECT_THAT(faults(), IsEmpty());
}

TEST_F(Judge, SeesAMotionThatNobodyCalled) {
  call("StartDrive", 401, "ok", 1);
  move(1, sign_degrees(10, 401));
  move(2, sign_degrees(10, 777));
  EXPECT_THAT(faults(), Contains(HasSubstr("nobody called")));
}

TEST_F(Judge, SeesAMotionThatWasRefused) {
  call("StartDrive", 401, "QueueFull");
  move(1, sign_degrees(10, 401));
  EXPECT_THAT(faults(), Contains(HasSubstr("was refused, and carried out")));
}

TEST_F(Judge, SeesATicketOfAnothersMotion) {
  call("StartDrive", 401, "ok", 2);
  call("StartDrive", 402, "ok", 1);
  move(1, sign_degrees(10, 401));
  EXPECT_THAT(faults(), Contains(HasSubstr("which carried out")));
}

TEST_F(Judge, SeesAMotionAfterAStop) {
  call("StartDrive", 401, "ok", 1);
  rest(1);
  call("Stop", 0);
  rest(5);
  move(1, sign_degrees(10, 401));
  EXPECT_THAT(faults(), Contains(HasSubstr("before client 1 call 2 Stop")));
}

TEST_F(Judge, SeesAMotionThatAStopDoesNotEnd) {
  begin("Drive", 401);
  move(1, sign_degrees(10, 401), [this](int cycle) {
    if (cycle == 50) call("Stop", 0);
  });
  EXPECT_THAT(faults(), Contains(HasSubstr("before client 1 call 2 Stop")));
}

TEST_F(Judge, GivesEachCallOneMotion) {
  begin("Drive", 401);
  move(1, 1.234);  // stopped on the way
  EXPECT_THAT(faults(), IsEmpty());
  move(2, 1.345);
  EXPECT_THAT(faults(), Contains(HasSubstr("nobody called")));
}

TEST_F(Judge, SeesASetPointBeyondTheJointsSpeed) {
  call("StartDrive", 401, "ok", 1);
  base_deg_ += 0.5;  // in a millisecond
  row(1, "moving");
  EXPECT_THAT(faults(), Contains(HasSubstr("joint 0 by 0.5 degrees in 1 cycles")));
}

TEST_F(Judge, SeesASetPointBeyondTheJointsRange) {
  while (base_deg_ < 90.2) {
    base_deg_ += 0.15;
    row(1, "moving");
  }
  EXPECT_THAT(faults(), Contains(HasSubstr("allowed -90")));
}

TEST_F(Judge, SeesAJointThatMovesWithoutACommand) {
  base_deg_ += 0.01;
  rest(1);
  EXPECT_THAT(faults(), Contains(HasSubstr("without a command")));
}

TEST_F(Judge, SeesACommandThatRunsAgain) {
  call("StartDrive", 401, "ok", 1);
  move(1, sign_degrees(10, 401));
  move(1, sign_degrees(10, 401));
  EXPECT_THAT(faults(), Contains(HasSubstr("runs again")));
}

TEST_F(Judge, SeesAJumpAcrossCyclesThatWereNotRecorded) {
  base_deg_ += 30.0;
  cycle_ += 100;  // 18 degrees at most
  rest(1);
  EXPECT_THAT(faults(), Contains(HasSubstr("in 101 cycles")));
}

TEST_F(Judge, SeesAJointsAcceleration) {
  call("StartDrive", 401, "ok", 1);
  run(1, 120, [&](double s) { base_deg_ = s * sign_degrees(10, 401); });  // 2000 degrees/s^2
  EXPECT_THAT(faults(), Contains(HasSubstr("joint 0: acceleration in shares of its limit 2.")));
}

TEST_F(Judge, TakesWhereServosWithoutEnergyAreForNoEndOfAMotion) {
  call("StartDrive", 401, "ok", 1);
  const auto go = [&](double s) { base_deg_ = s * sign_degrees(10, 401); };
  for (int i = 1; i <= 400; ++i) {
    const double s = static_cast<double>(i) / 400;
    go(s * s * s * (10.0 - 15.0 * s + 6.0 * s * s));
    row(1, "moving");
  }
  flags_ = "power_off";
  base_deg_ -= 8.0;
  for (int i = 0; i < 5; ++i) row(0, "error");
  EXPECT_THAT(faults(), Not(Contains(HasSubstr("acceleration"))));
}

TEST_F(Judge, SeesAMotionThatIsCutWhereTheEnergyGoes) {
  call("StartDrive", 401, "ok", 1);
  const auto go = [&](double s) { base_deg_ = s * sign_degrees(10, 401); };
  for (int i = 1; i <= 200; ++i) {
    const double s = static_cast<double>(i) / 400;
    go(s * s * s * (10.0 - 15.0 * s + 6.0 * s * s));
    row(1, "moving");
  }
  flags_ = "power_off";
  for (int i = 0; i < 5; ++i) row(0, "error");
  EXPECT_THAT(faults(), Contains(HasSubstr("joint 0: acceleration in shares of its limit")));
}

TEST_F(Judge, SeesAJointsJerk) {
  call("StartDrive", 401, "ok", 1);
  run(1, 200,
      [&](double s) { base_deg_ = s * sign_degrees(10, 401); });  // 720 degrees/s^2, 37,500 degrees/s^3
  EXPECT_THAT(faults(), Contains(HasSubstr("joint 0: jerk in shares of its limit 4.")));
}

TEST_F(Judge, SeesAnArmThatGoesOnAtFullSpeedAfterAGap) {
  call("StartDrive", 401, "ok", 1);
  std::uint64_t id = 0;
  const auto with_gap = [&](double s) {
    move(++id, sign_degrees(10, 401), [&](int cycle) {
      if (cycle == 200) silence(s);
    });
  };
  with_gap(0.004);
  EXPECT_THAT(faults(), IsEmpty()) << "four periods are made up for by nothing, and no rest either";
  call("StartDrive", 401, "ok", 2);
  with_gap(0.010);
  EXPECT_THAT(faults(), Contains(HasSubstr("joint 0: acceleration")));
}

TEST_F(Judge, SeesAMotionThatDoesNotEndAtRest) {
  call("StartDrive", 401, "ok", 1);
  const double speed_deg = sign_degrees(10, 401) / 200;
  run(1, 400, [&](double s) { base_deg_ = s < 0.5 ? s * sign_degrees(10, 401) : base_deg_ + speed_deg; });
  EXPECT_THAT(faults(), Contains(HasSubstr("joint 0: acceleration")));
}

TEST_F(Judge, SeesAnotherJointInADrive) {
  call("StartDrive", 401, "ok", 1);
  run(1, 400, [&](double s) {
    base_deg_ = s * sign_degrees(10, 401);
    shoulder_deg_ = 0.5 * s * (1.0 - s);
  });
  EXPECT_THAT(faults(), Contains(HasSubstr("joint 1 moves up")));
}

TEST_F(Judge, SeesAJointThatGoesBackOnItsWay) {
  call("StartDrive", 401, "ok", 1);
  run(1, 800, [&](double s) { base_deg_ = sign_degrees(10, 401) * (s + 0.4 * std::sin(2.0 * M_PI * s)); });
  EXPECT_THAT(faults(), Contains(HasSubstr("joint 0 moves down")));
}

TEST_F(Judge, FollowsLinesAndArcs) {
  call("StartMoveS", 401, "ok", 1);
  line(1, 401);
  go_to_arc(402);
  call("StartMoveC", 402, "ok", 2);
  arc(2, 402, 1500);
  EXPECT_THAT(faults(), IsEmpty());
  EXPECT_EQ(verdict().paths, 2);
  EXPECT_EQ(verdict().motions_by_kind.at("arc"), 1);
}

TEST_F(Judge, SeesATooFastToolOnALine) {
  call("StartMoveS", 401, "ok", 1);
  line(1, 401, 200);
  EXPECT_THAT(faults(), Contains(HasSubstr("the tool at m/s 0.28")));
}

TEST_F(Judge, SeesATooFastToolOnALineThatWasStopped) {
  call("StartMoveS", 401, "ok", 1);
  run(1, 200, [&](double s) { y_m_ = s * 0.029; });
  EXPECT_THAT(faults(), Contains(HasSubstr("the tool at m/s 0.27")));
}

TEST_F(Judge, SeesTheToolsAccelerationOnALine) {
  call("StartMoveS", 401, "ok", 1);
  line(1, 401, 300);
  EXPECT_THAT(faults(), Contains(HasSubstr("the tool's acceleration in m/s^2 1.9")));
}

TEST_F(Judge, SeesTheAccelerationTowardsTheCentreOfAnArc) {
  go_to_arc(401);
  call("StartMoveC", 401, "ok", 1);
  arc(1, 401, 800);  // 0.18 m/s: 1.3 m/s^2 towards the centre, 0.7 along
  EXPECT_THAT(faults(), Contains(HasSubstr("the tool's acceleration in m/s^2 1.3")));
}

TEST_F(Judge, SeesTheToolsJerk) {
  call("StartMoveS", 401, "ok", 1);
  line(1, 401, 500);
  EXPECT_THAT(faults(), Contains(HasSubstr("the tool's jerk in m/s^3 14.")));
}

TEST_F(Judge, SeesALineThatIsNotStraight) {
  call("StartMoveS", 401, "ok", 1);
  line(1, 401, 700, 1e-5);
  EXPECT_THAT(faults(), Contains(HasSubstr("off its path")));
}

TEST_F(Judge, SeesAnArcThatIsNotRound) {
  go_to_arc(401);
  call("StartMoveC", 401, "ok", 1);
  arc(1, 401, 1500, 1e-5);
  EXPECT_THAT(faults(), Contains(HasSubstr("off its path")));
}

TEST_F(Judge, SeesALineThatGoesBack) {
  call("StartMoveS", 401, "ok", 1);
  const double to_m = sign_metres(305, 401);
  run(1, 3000, [&](double s) { y_m_ = to_m * (s + 0.3 * std::sin(2.0 * M_PI * s)); });
  EXPECT_THAT(faults(), Contains(HasSubstr("goes back")));
}

TEST_F(Judge, SeesAnArcCarriedOutTwice) {
  for (const int id : {2, 4}) {
    go_to_arc(401);
    call("StartMoveC", 401, id == 2 ? "ok" : "COMM_FAILURE/2", id == 2 ? 2 : 0);
    if (id == 4) break;
    arc(2, 401, 1500);
    EXPECT_THAT(faults(), IsEmpty());
  }
  arc(4, 401, 1500);
  go_to_arc(401);
  arc(6, 401, 1500);
  EXPECT_THAT(faults(), Contains(HasSubstr("carried out twice")));
}

TEST_F(Judge, SeesAnAnswerThatIsUntrue) {
  call("Drive", 401);
  rest(10);
  EXPECT_THAT(faults(), Contains(HasSubstr("was not carried out to its end")));
}

TEST_F(Judge, SeesAStateThatHidesAFrozenTask) {
  silence(0.8);
  call("Status", 0, "Standby");
  silence(0.01);
  rest(1);
  EXPECT_THAT(faults(), Contains(HasSubstr("was told 'Standby'")));
}

TEST_F(Judge, SeesATaskThatDoesNotComeBack) {
  const std::int64_t killed_ns = now_ns();
  silence(3.0);
  rest(1);
  EXPECT_THAT(faults(), Contains(HasSubstr("nothing explains 3.0")));
  restarts_ = {{killed_ns + 1'000'000, 1.6}};
  EXPECT_THAT(faults(), Contains(HasSubstr("nothing explains 1.4")));
  breaks_ = {{{killed_ns, killed_ns + 700'000'000}, "freeze supervisor"}};
  EXPECT_THAT(faults(), IsEmpty());
}

TEST_F(Judge, SeesAClearThatNobodyShouldHaveNeeded) {
  const Interval now{now_ns(), now_ns() + 10 * kCycle_ns};
  clears_ = {{now, "131 Error inherited"}};
  breaks_ = {{now, "kill servant"}};
  EXPECT_THAT(faults(), Contains(HasSubstr("cleared '131 Error inherited' after kill servant")));
  breaks_ = {{now, "freeze task"}};
  EXPECT_THAT(faults(), IsEmpty());
}

TEST_F(Judge, AcceptsAClearAfterAPauseOfTheMachineButNotAfterARestart) {
  breaks_ = {{{now_ns(), now_ns()}, "kill task"}};
  silence(0.15);  // from one cycle to the next
  rest(1);
  clears_ = {{{now_ns(), now_ns()}, "141 gap"}};
  EXPECT_THAT(faults(), Contains(HasSubstr("cleared '141 gap'")));
  breaks_.clear();
  EXPECT_THAT(faults(), IsEmpty());
}

}  // namespace
}  // namespace corbot::soak
