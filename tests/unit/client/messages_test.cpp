// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "client/client.h"
#include "client/explain.h"

namespace corbot::client {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::Not;

const Address kAddress{"corbaloc::127.0.0.1:12810/lynx1", "lynx1", "127.0.0.1:12810"};

/// The message and exit code when a call raises `e`.
template <class Exception>
Failure failure_of(const Exception& e) {
  try {
    call(kAddress, [&] { throw e; });
  } catch (const Failure& failure) {
    return failure;
  }
  return {ExitCode::kOk, "nothing was thrown"};
}

TEST(Message, BadParameterNamesValueAndReason) {
  const Failure f = failure_of(Corbot::BadParameter("t", -1.5, "must not be negative."));
  EXPECT_EQ(f.code(), ExitCode::kRefused);
  EXPECT_STREQ(f.what(), "refused: t = -1.5: must not be negative; this command moved nothing");
}

TEST(Message, AReasonThatNamesItsParameterHasNoValueBeforeIt) {
  EXPECT_STREQ(failure_of(Corbot::BadParameter("P2", 0, "P1 and P2 are 0 m apart")).what(),
               "refused: P1 and P2 are 0 m apart; this command moved nothing");
  EXPECT_THAT(failure_of(Corbot::BadParameter("P", 7, "P2 or Pz")).what(), HasSubstr("P = 7: P2 or Pz;"));
}

TEST(Message, AJointThatIsNoneIsCalledAJointOnce) {
  EXPECT_STREQ(failure_of(Corbot::BadParameter("articulation", 7, "joint 7, allowed 0 to 3")).what(),
               "refused: joint 7, allowed 0 to 3; this command moved nothing");
}

TEST(Message, AnUnknownEndNamesTheMotion) {
  const Failure f = unknown_end(17, "the servant at h:1 closed the connection");
  EXPECT_EQ(f.code(), ExitCode::kUnreachable);
  EXPECT_THAT(f.what(), AllOf(HasSubstr("h:1 closed the connection"), HasSubstr("motion 17 is unknown"),
                              HasSubstr("corbot cancel 17")));
}

TEST(Message, ACallThatIsNotAnsweredMayHaveBeenCarriedOut) {
  EXPECT_TRUE(is_certainly_not_executed(CORBA::TRANSIENT(0, CORBA::COMPLETED_NO)));
  EXPECT_FALSE(is_certainly_not_executed(CORBA::COMM_FAILURE(0, CORBA::COMPLETED_MAYBE)));
  EXPECT_FALSE(is_certainly_not_executed(CORBA::TIMEOUT(0, CORBA::COMPLETED_NO)));
  EXPECT_FALSE(
      is_certainly_not_executed(CORBA::TRANSIENT(omni::TRANSIENT_CallTimedout, CORBA::COMPLETED_NO)));
  const Failure f = unknown_start(Failure(ExitCode::kUnreachable, "no answer"));
  EXPECT_EQ(f.code(), ExitCode::kUnreachable);
  EXPECT_THAT(f.what(),
              AllOf(HasSubstr("no answer"), HasSubstr("whether the robot accepted the motion is unknown")));
}

TEST(Message, AJointThatIsNoneIsAnsweredWithTheNames) {
  const std::vector<std::string> names{"base", "shoulder", "elbow"};
  EXPECT_EQ(number_of_joint(names, "elbow"), 2);
  try {
    (void)number_of_joint(names, "sholder");
    ADD_FAILURE() << "found";
  } catch (const Failure& failure) {
    EXPECT_EQ(failure.code(), ExitCode::kUsage);
    EXPECT_STREQ(failure.what(),
                 "JOINT 'sholder': the arm has no such joint; its joints are base, shoulder, elbow (0 to 2); "
                 "did you mean 'shoulder'?");
  }
}

TEST(Message, CommandsOfOtherProgramsAreUnderstood) {
  const std::vector<std::string_view> commands{"up", "delay", "move", "status", "limit"};
  EXPECT_EQ(suggest_command("UP", commands), "; did you mean 'up'?");
  EXPECT_EQ(suggest_command("wait", commands), "; did you mean 'delay'?");
  EXPECT_EQ(suggest_command("list", commands), "; did you mean 'status'?");
  EXPECT_EQ(suggest_command("halt", commands), "") << "'stop' is no command here";
}

TEST(Message, MethodsOfThePythonPackageAreUnderstood) {
  std::vector<std::string_view> commands;
  for (const VerbSpec& spec : verbs()) commands.push_back(spec.word);
  EXPECT_EQ(suggest_command("line", commands), "; did you mean 'moves'?");
  EXPECT_EQ(suggest_command("arc", commands), "; did you mean 'movec'?");
  EXPECT_EQ(suggest_command("pose", commands), "; did you mean 'movepose'?");
  EXPECT_EQ(suggest_command("relative", commands), "; did you mean 'moverelative'?");
}

TEST(Message, UnreachableNamesThePoint) {
  const Failure f = failure_of(Corbot::Unreachable({1, -2, 0.5}, "too far"));
  EXPECT_EQ(f.code(), ExitCode::kRefused);
  EXPECT_THAT(f.what(), AllOf(HasSubstr("(1, -2, 0.5) m"), HasSubstr("too far"), HasSubstr("corbot status")));
}

TEST(Message, UnreachableNamesTheSettingsUnlessTheUnitIsWrong) {
  const std::string settings = "; the tool pitch is 0 degrees";
  EXPECT_THAT(explain(Corbot::Unreachable({0.2, 0, 0.3}, "too far"), settings).what(),
              HasSubstr("too far; the tool pitch is 0 degrees; this command moved nothing"));
  EXPECT_THAT(explain(Corbot::Unreachable({20, 5, 8}, "too far"), settings).what(), Not(HasSubstr("pitch")));
}

TEST(Message, ASoftLimitIsTold) {
  Corbot::JointInfo joint{};
  joint.range = {-90, 90};
  EXPECT_THAT(explain(Corbot::LimitExceeded("joint range", 0, 85, -80, 80), joint).what(),
              HasSubstr("-80 to 80 degrees; these are soft limits, the joint's range is -90 to 90 ('corbot"));
  EXPECT_THAT(explain(Corbot::LimitExceeded("joint range", 0, 95, -90, 90), joint).what(),
              Not(HasSubstr("soft")));
}

TEST(Message, CentimetresAreRecognised) {
  EXPECT_THAT(failure_of(Corbot::Unreachable({20, 5, 8}, "the target is too far")).what(),
              HasSubstr("numbers are metres: 20 cm is 0.20"));
  EXPECT_THAT(failure_of(Corbot::Unreachable({20, 5, 8}, "no joints are found for the target")).what(),
              HasSubstr("numbers are metres: 20 cm is 0.20"));
  EXPECT_THAT(failure_of(Corbot::Unreachable({2, 0.5, 0.8}, "the target is too far")).what(),
              Not(HasSubstr("20 cm")));
}

TEST(Message, LimitNamesJointAndBothBounds) {
  EXPECT_THAT(
      failure_of(Corbot::LimitExceeded("angle", 2, 160, -30, 150)).what(),
      testing::StrEq("refused: angle of joint 2: 160 is not within -30 to 150; this command moved nothing"));
  EXPECT_THAT(failure_of(Corbot::LimitExceeded("speed", -1, 2, 0, 1)).what(), Not(HasSubstr("joint")));
}

TEST(Message, ABreachOfTheWorkspaceIsASentence) {
  EXPECT_STREQ(failure_of(Corbot::LimitExceeded("workspace: the wrist would be 12 mm below 'floor'", -1,
                                                -0.012, 0, 1000))
                   .what(),
               "refused: the wrist would be 12 mm below 'floor'; this command moved nothing");
}

TEST(Message, ARefusedPlaneOrBoxIsASentenceWithoutItsParameter) {
  EXPECT_STREQ(
      failure_of(Corbot::BadParameter("workspace", 57, "'low': parts tool, hand: none of this arm")).what(),
      "refused: 'low': parts tool, hand: none of this arm; this command moved nothing");
}

TEST(Message, ALimitHasTheUnitOfItsJointWhereThatIsKnown) {
  const auto text = [](const char* quantity, std::optional<Corbot::JointKind> kind) {
    std::optional<Corbot::JointInfo> joint;
    if (kind) joint = Corbot::JointInfo{"lift", *kind, {-1, 1}, 0.0};
    return std::string(explain(Corbot::LimitExceeded(quantity, 2, 0.1, -0.15, 0), joint).what());
  };
  EXPECT_THAT(text("joint range", Corbot::JointSlides), HasSubstr("0.1 is not within -0.15 to 0 m;"));
  EXPECT_THAT(text("joint position", Corbot::JointTurns), HasSubstr("to 0 degrees;"));
  EXPECT_THAT(text("speed", Corbot::JointSlides), HasSubstr("to 0 m a second;"));
  EXPECT_THAT(text("speed", Corbot::JointTurns), HasSubstr("to 0 degrees a second;"));
  EXPECT_THAT(text("joint range", std::nullopt), HasSubstr("to 0;"));
  EXPECT_THAT(explain(Corbot::LimitExceeded("duration", -1, 4000, 0, 3600)).what(), HasSubstr("3600 s;"));
}

TEST(Message, ASpeedLimitSaysThatTheSpeedIsLowered) {
  const Corbot::JointInfo joint{"base", Corbot::JointTurns, {-90, 90}, 180.0};
  EXPECT_THAT(
      explain(Corbot::LimitExceeded("speed", 0, 100, 0, 9), joint).what(),
      HasSubstr("100 is not within 0 to 9 degrees a second (180 at 100 %, the speed in force is 5 %: "));
  EXPECT_THAT(explain(Corbot::LimitExceeded("speed", 0, 200, 0, 180), joint).what(),
              Not(HasSubstr("at 100 %")));
  EXPECT_THAT(explain(Corbot::LimitExceeded("joint range", 0, 100, 0, 9), joint).what(),
              Not(HasSubstr("at 100 %")));
}

TEST(Message, TheReachIsPointedToWhereItMatters) {
  EXPECT_THAT(
      failure_of(Corbot::Unreachable({0, 0, 1}, "no nearer to that orientation than 10 degrees")).what(),
      Not(HasSubstr("shows the reach")));
}

TEST(Message, NotReadyStoppedAndQueueFull) {
  const Failure not_ready = failure_of(Corbot::NotReady("the real-time task is gone"));
  EXPECT_EQ(not_ready.code(), ExitCode::kRefused);
  EXPECT_THAT(not_ready.what(), AllOf(HasSubstr("the real-time task is gone"), HasSubstr("corbot alarms")));
  EXPECT_EQ(failure_of(Corbot::Stopped("Stop")).code(), ExitCode::kStopped);
  const Failure full = failure_of(Corbot::QueueFull(16));
  EXPECT_EQ(full.code(), ExitCode::kRefused);
  EXPECT_THAT(full.what(), HasSubstr("16 motions"));
  EXPECT_THAT(
      failure_of(Corbot::QueueFull(4)).what(),
      AllOf(HasSubstr("4 calls of this machine already wait"), HasSubstr("StartMove"),
            HasSubstr("or 4 motions are queued, which is the limit of the profile's [servant] queue")));
}

TEST(Message, NoServantSaysWhereAndHowToStart) {
  const Failure f = failure_of(CORBA::TRANSIENT(omni::TRANSIENT_ConnectFailed, CORBA::COMPLETED_NO));
  EXPECT_EQ(f.code(), ExitCode::kUnreachable);
  EXPECT_THAT(f.what(), AllOf(HasSubstr("no servant at 127.0.0.1:12810"), HasSubstr("corbot up"),
                              Not(HasSubstr("TRANSIENT"))));
}

TEST(Message, AHostWithoutAnAddressIsNamed) {
  const Address address{"corbaloc::nowhere.invalid:12810/lynx1", "lynx1", "nowhere.invalid:12810"};
  const CORBA::TRANSIENT e(omni::TRANSIENT_ConnectFailed, CORBA::COMPLETED_NO);
  EXPECT_THAT(explain(e, address).what(),
              AllOf(HasSubstr("'nowhere.invalid' is not a host"), HasSubstr("192.168.1.5:12810/NAME")));
}

TEST(Message, EachOrbFailureHasItsMessage) {
  EXPECT_THAT(failure_of(CORBA::TRANSIENT(omni::TRANSIENT_CallTimedout, CORBA::COMPLETED_NO)).what(),
              HasSubstr("no answer from 127.0.0.1:12810 in time"));
  EXPECT_THAT(failure_of(CORBA::COMM_FAILURE(0, CORBA::COMPLETED_MAYBE)).what(),
              HasSubstr("closed the connection"));
  EXPECT_THAT(failure_of(CORBA::OBJECT_NOT_EXIST(0, CORBA::COMPLETED_NO)).what(),
              HasSubstr("no robot named 'lynx1'"));
  EXPECT_EQ(failure_of(CORBA::INV_OBJREF(0, CORBA::COMPLETED_NO)).code(), ExitCode::kUsage);
  EXPECT_EQ(failure_of(CORBA::BAD_OPERATION(0, CORBA::COMPLETED_NO)).code(), ExitCode::kInternal);
  EXPECT_EQ(failure_of(CORBA::UNKNOWN(7, CORBA::COMPLETED_NO)).code(), ExitCode::kInternal);
}

TEST(Message, NoTextFromTheNetworkReachesTheTerminalRaw) {
  EXPECT_EQ(printable("a\x1b[2Jb\n\xff"), "a?[2Jb??");
  EXPECT_EQ(printable(std::string(1000, 'x')).size(), 400u);
}

TEST(Message, NumbersArePlain) {
  EXPECT_EQ(plain(0.1 + 0.2), "0.3");
  EXPECT_EQ(plain(-1e-17), "0");
  EXPECT_EQ(plain(1e308), "1e+308");
}

TEST(Robot, AddressesAreUnderstood) {
  EXPECT_EQ(find_robot("corbaloc::h:1/a").where, "h:1");
  EXPECT_EQ(find_robot("corbaloc:iiop:1.2@h:1/a").where, "h:1");
  EXPECT_EQ(find_robot("h:1/a").uri, "corbaloc::h:1/a");
  EXPECT_EQ(find_robot("h:1/a").name, "a");
  EXPECT_THROW((void)find_robot("not a robot"), Failure);
}

TEST(Robot, ConnectingWithoutAServantIsUnreachable) {
  try {
    const Client client(find_robot("127.0.0.1:1/lynx1"), 2.0);
    FAIL() << "something answers at port 1";
  } catch (const Failure& failure) {
    EXPECT_EQ(failure.code(), ExitCode::kUnreachable);
    EXPECT_THAT(failure.what(), HasSubstr("no servant at 127.0.0.1:1"));
  }
}

}  // namespace
}  // namespace corbot::client
