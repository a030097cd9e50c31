// SPDX-License-Identifier: Apache-2.0
// What the soak must notice is planted here: made-up recordings and made-up reports of clients.
#include "soak/verdict.h"

#include <fmt/format.h>
#include <gmock/gmock.h>

#include <functional>

#include "config/load_profile.h"
#include "soak/signature.h"

namespace corbot::soak {
namespace {

using testing::Contains;
using testing::HasSubstr;
using testing::IsEmpty;

constexpr std::int64_t kCycle_ns = 1'000'000;

class Judge : public ::testing::Test {
 protected:
  Judge() : profile_(load_profile(CORBOT_PROFILE)), recording_(profile_) {
    recording_.read("cycle,time_ns");
    rest(3);
  }

  void row(std::uint64_t command, const char* state) {
    ++cycle_;
    recording_.read(fmt::format("{},{},0,{},{},1,{:.9f},{:.9f},0,0,0.3,{:.12f},0.1,0", cycle_, now_ns(),
                                state, command, base_deg_, shoulder_deg_, y_m_));
  }
  void rest(int cycles) {
    for (int i = 0; i < cycles; ++i) row(0, "standby");
  }
  /// Command `id` turns the base by `degrees` at a speed that is allowed, then rests.
  void move(
      std::uint64_t id, double degrees, const std::function<void(int cycle)>& meanwhile = [](int) {}) {
    constexpr int kCycles = 100;
    const double from_deg = base_deg_;
    for (int i = 1; i <= kCycles; ++i) {
      base_deg_ = from_deg + degrees * i / (kCycles + 1);
      row(id, "moving");
      meanwhile(i);
    }
    base_deg_ = from_deg + degrees;
    rest(2);
  }
  [[nodiscard]] std::int64_t now_ns() const {
    return static_cast<std::int64_t>(cycle_) * kCycle_ns + time_ns_;
  }

  /// A call that begins now and is answered at once.
  void call(const std::string& operation, std::int64_t mark, const std::string& outcome = "ok",
            std::uint64_t ticket = 0, double took_s = 0.0) {
    begin(operation, mark);
    ledger_.read(1, fmt::format("end {} {} {} {}", calls_, now_ns() + static_cast<std::int64_t>(took_s * 1e9),
                                outcome, ticket));
  }
  void begin(const std::string& operation, std::int64_t mark) {
    begin(operation, mark, sign_degrees(10, mark));
  }
  /// A drive of the base by so much; a line ends at sign_metres(305, mark).
  void begin(const std::string& operation, std::int64_t mark, double by_deg) {
    const std::string where = operation == "StartMoveS"
                                  ? fmt::format("0.3 {:.15f} 0.1", sign_metres(305, mark))
                                  : fmt::format("0 {:.12f}", by_deg);
    ledger_.read(1, fmt::format("begin {} {} {} {} {}", ++calls_, now_ns(), operation, mark, where));
  }

  [[nodiscard]] std::vector<std::string> faults(const std::vector<Disturbance>& disturbances = {},
                                                const std::vector<Clear>& clears = {}) const {
    return judge(profile_, ledger_, recording_, disturbances, clears).faults;
  }

  Profile profile_;
  Recording recording_;
  Ledger ledger_;
  std::uint64_t cycle_{100};
  std::int64_t time_ns_{0};  // in which no cycle ran
  int calls_{0};
  double base_deg_{0.0};
  double shoulder_deg_{0.0};
  double y_m_{0.0};
};

TEST_F(Judge, FindsNothingInAGoodRun) {
  call("StartDrive", 401, "ok", 1);
  move(1, sign_degrees(10, 401));
  begin("Drive", 402, -sign_degrees(12, 402));
  move(2, -sign_degrees(12, 402));
  call("Stop", 0);
  const Verdict verdict = judge(profile_, ledger_, recording_, {});
  EXPECT_THAT(verdict.faults, IsEmpty());
  EXPECT_EQ(verdict.whole_motions, 2);
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
  begin("StartMoveJoints", 1232, 0.0);
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
  EXPECT_THAT(faults(), Contains(HasSubstr("'s Stop")));
}

TEST_F(Judge, SeesAMotionThatAStopDoesNotEnd) {
  begin("Drive", 401);
  move(1, sign_degrees(10, 401), [this](int cycle) {
    if (cycle == 50) call("Stop", 0);
  });
  EXPECT_THAT(faults(), Contains(HasSubstr("'s Stop")));
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

TEST_F(Judge, SeesATooFastToolOnALine) {
  call("StartMoveS", 401, "ok", 1);
  for (int i = 0; i < 100; ++i) {
    y_m_ += 0.0003;
    base_deg_ += 0.01;
    row(1, "moving");
  }
  y_m_ = sign_metres(305, 401);
  base_deg_ += 0.01;
  rest(2);
  EXPECT_THAT(faults(), Contains(HasSubstr("m/s on a line")));
}

TEST_F(Judge, SeesAStateThatHidesAFrozenTask) {
  const std::int64_t frozen_ns = now_ns();
  cycle_ += 800;
  call("Status", 0, "Standby");
  cycle_ += 10;
  rest(1);
  EXPECT_THAT(faults(), Contains(HasSubstr("was told 'Standby'")));
  EXPECT_GT(now_ns(), frozen_ns + 800 * kCycle_ns);
}

TEST_F(Judge, SeesAClearThatNobodyShouldHaveNeeded) {
  const Disturbance killed{now_ns(), now_ns() + 10 * kCycle_ns, "kill servant"};
  const Disturbance frozen{now_ns(), now_ns() + 10 * kCycle_ns, "cut connections + freeze task"};
  const Clear clear{now_ns() + kCycle_ns, "131 Error inherited"};
  EXPECT_THAT(faults({killed}, {clear}),
              Contains(HasSubstr("cleared '131 Error inherited' after kill servant")));
  EXPECT_THAT(faults({frozen}, {clear}), IsEmpty());
}

TEST_F(Judge, AcceptsAClearAfterAPauseOfTheMachine) {
  time_ns_ += 150 * kCycle_ns;  // from one cycle to the next
  rest(1);
  EXPECT_THAT(faults({}, {{now_ns(), "141 gap"}}), IsEmpty());
}

TEST_F(Judge, SeesAnAnswerThatComesTooLate) {
  call("Status", 0, "ok", 0, 8.0);
  EXPECT_THAT(faults(), Contains(HasSubstr("bound 5 s")));
  EXPECT_THAT(faults({{0, now_ns() + kCycle_ns, "kill servant"}}), IsEmpty()) << "disturbed";
}

}  // namespace
}  // namespace corbot::soak
