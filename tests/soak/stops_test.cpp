// SPDX-License-Identifier: Apache-2.0
// Stops, holds, pauses, exclusive control, and how long a caller may wait: planted as in verdict_test.cpp.
#include <gmock/gmock.h>

#include "soak/judge_fixture.h"

namespace corbot::soak {
namespace {

using testing::Contains;
using testing::HasSubstr;
using testing::IsEmpty;

class StopJudge : public Judge {
 protected:
  void accept_and_move(std::uint64_t id, const Meanwhile& meanwhile = {}) {
    const std::int64_t mark = 400 + static_cast<std::int64_t>(id);
    call("StartDrive", mark, "ok", id);
    move(id, sign_degrees(10, mark), meanwhile);
  }
};

TEST_F(StopJudge, SeesAMotionAfterEachKindOfStop) {
  std::uint64_t id = 0;
  for (const char* stop : {"Stop", "Release", "corbot-stop"}) {
    call("StartDrive", 401 + static_cast<std::int64_t>(id), "ok", id + 1);
    rest(2);
    call(stop, 0);
    rest(2);
    ++id;
    move(id, sign_degrees(10, 400 + static_cast<std::int64_t>(id)));
    EXPECT_THAT(faults(),
                Contains(testing::AllOf(HasSubstr(std::string(" ") + stop + " "), HasSubstr("s after it"))));
    EXPECT_EQ(verdict().stops.at(stop), 1);
    cycle_ += 3000;  // 300 degrees: another run
    rest(1);
  }
}

TEST_F(StopJudge, JudgesByArrival) {
  const int waiting = begin("Drive", 401);
  rest(700);
  call("Stop", 0);
  rest(2);
  move(1, sign_degrees(10, 401));
  end(waiting, "ok");
  EXPECT_THAT(faults(), Contains(HasSubstr("before client 1 call 2 Stop")));
  breaks_ = {{{0, now_ns()}, "freeze servant"}};  // then it may have been in the socket
  EXPECT_THAT(faults(), IsEmpty());
}

TEST_F(StopJudge, LetsMoveWhatComesAfterTheStop) {
  const int stop = begin("Stop", 0);
  call("StartDrive", 401, "ok", 1);
  end(stop, "ok");
  move(1, sign_degrees(10, 401));
  EXPECT_THAT(faults(), IsEmpty());
}

TEST_F(StopJudge, SeesMovementOfAnArmThatIsHeld) {
  call("StopAndHold", 0);
  rest(5);
  const std::int64_t before_ns = now_ns();
  accept_and_move(1);
  EXPECT_THAT(faults(), Contains(HasSubstr("which nobody has cleared")));
  clears_ = {{{before_ns - 2 * kCycle_ns, before_ns - kCycle_ns}, "133 held"}};
  EXPECT_THAT(faults(), IsEmpty());
}

TEST_F(StopJudge, SeesAHoldThatARestartHasLost) {
  call("StopAndHold", 0);
  rest(500);
  breaks_ = {{{now_ns(), now_ns()}, "kill supervisor"}};
  call("Status", 0, "Standby");
  EXPECT_THAT(faults(), Contains(HasSubstr("while the arm is held")));
}

TEST_F(StopJudge, SeesMovementOfAnArmThatIsPaused) {
  call("Pause", 0);
  rest(500);
  accept_and_move(1);
  EXPECT_THAT(faults(), IsEmpty()) << "as long as a stop may take";
  rest(700);
  accept_and_move(2);
  EXPECT_THAT(faults(), Contains(HasSubstr("which nobody has resumed")));
}

TEST_F(StopJudge, LetsMoveAfterAResume) {
  call("Pause", 0);
  rest(2500);
  client_ = 2;
  call("Resume", 0);
  accept_and_move(1);
  EXPECT_THAT(faults(), IsEmpty());
}

TEST_F(StopJudge, SeesAMotionThatWasTakenBack) {
  call("StartDrive", 401, "ok", 1);
  call("StartDrive", 402, "ok", 2);
  move(1, 3.0, [this](int cycle) {
    if (cycle == 200) begin("Cancel", 1);
  });
  end(calls_, "ok");
  EXPECT_THAT(faults(), IsEmpty());
  move(2, sign_degrees(10, 402));
  EXPECT_THAT(faults(), Contains(HasSubstr("Cancel (signature 1")));
}

TEST_F(StopJudge, SeesAnothersMotionWhileOneHasControl) {
  call("Acquire", 0, "ok", 0, 0.0, "1.0");
  key_ = calls_;
  accept_and_move(1);
  key_ = 0;
  client_ = 2;
  EXPECT_THAT(faults(), IsEmpty());
  call("StartDrive", 402, "NotReady");
  EXPECT_THAT(faults(), IsEmpty());
  accept_and_move(3);
  EXPECT_THAT(faults(), Contains(HasSubstr("began while client 1 call 1 Acquire")));
  EXPECT_THAT(
      faults(),
      Contains(HasSubstr("client 2 call 4 StartDrive (signature 403, answered 'ok' after 0.000 s) while")));
}

TEST_F(StopJudge, LetsOthersMoveWhenTheLeaseMayHaveRunOut) {
  call("Acquire", 0, "ok", 0, 0.0, "1.0");
  rest(1100);
  client_ = 2;
  accept_and_move(1);
  EXPECT_THAT(faults(), IsEmpty());
}

TEST_F(StopJudge, SeesALeaseThatDoesNotStopTheArm) {
  call("Acquire", 0, "ok", 0, 0.0, "0.5");
  key_ = calls_;
  call("StartDrive", 401, "ok", 1);
  const double by_deg = sign_degrees(10, 401);
  run(1, 1200, [&](double s) { base_deg_ = s * by_deg; });
  rest(2000);
  EXPECT_THAT(faults(), IsEmpty()) << "a stop may take as long";
  EXPECT_EQ(verdict().expired, 1);
  key_ = 0;
  call("Acquire", 0, "ok", 0, 0.0, "0.5");
  key_ = calls_;
  call("StartDrive", 402, "ok", 2);
  run(2, 4000, [&](double s) { base_deg_ = by_deg + s * sign_degrees(10, 402); });
  rest(1);
  EXPECT_THAT(faults(), Contains(HasSubstr("ran out")));
}

TEST_F(StopJudge, SeesAKeyThatOutlivesItsLease) {
  call("Acquire", 0, "ok", 0, 0.0, "0.5");
  key_ = calls_;
  rest(900);
  call("Renew", 0);
  rest(4000);
  EXPECT_THAT(faults(), Contains(HasSubstr("Renew (signature 0, answered 'ok' after 0.000 s) was accepted")));
}

TEST_F(StopJudge, SeesAnAnswerThatComesTooLate) {
  call("Status", 0, "Standby", 0, 0.8);
  EXPECT_THAT(faults(), Contains(HasSubstr("bound 0.500 s")));
  breaks_ = {{{now_ns(), now_ns() + 400'000'000}, "kill servant"}};
  EXPECT_THAT(faults(), Contains(HasSubstr("bound 0.500 s"))) << "a connection that is lost is an answer";
  breaks_[0].what = "freeze servant";
  EXPECT_THAT(faults(), IsEmpty());
  breaks_[0].what = "freeze client";
  breaks_[0].client = 2;
  EXPECT_THAT(faults(), Contains(HasSubstr("bound 0.500 s"))) << "another one";
  breaks_.clear();
  stalls_ = {{now_ns(), now_ns() + 400'000'000}};
  EXPECT_THAT(faults(), IsEmpty());
}

TEST_F(StopJudge, SeesAWaitBeyondItsTime) {
  call("Wait", 1, "ok", 0, 1.4, "1.0");
  EXPECT_THAT(faults(), IsEmpty());
  call("Wait", 1, "ok", 0, 1.6, "1.0");
  EXPECT_THAT(faults(), Contains(HasSubstr("bound 1.500 s")));
}

TEST_F(StopJudge, SeesACallerWhoWaitsForNothing) {
  const int waiting = begin("Drive", 401);
  rest(2000);
  move(1, 2.0);
  rest(2000);
  end(waiting, "Stopped");
  EXPECT_THAT(faults(), IsEmpty());
  const int forgotten = begin("Drive", 402);
  rest(3000);
  end(forgotten, "Stopped");
  EXPECT_THAT(faults(), Contains(HasSubstr("bound 2.500 s")));
}

TEST_F(StopJudge, SeesACallerWhoIsTooLateToldOfHisMotionsEnd) {
  const int waiting = begin("Drive", 401);
  move(1, sign_degrees(10, 401));
  rest(900);
  end(waiting, "ok");
  EXPECT_THAT(faults(), Contains(HasSubstr("after its motion had ended")));
}

}  // namespace
}  // namespace corbot::soak
