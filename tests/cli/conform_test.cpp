// SPDX-License-Identifier: Apache-2.0
// `corbot conform` against a robot of robot.idl alone, and against three that have a fault.
#include <gmock/gmock.h>
#include <signal.h>

#include <chrono>
#include <thread>

#include "cli_rig.h"

namespace corbot::test {
namespace {

using testing::AllOf;
using testing::ContainsRegex;
using testing::HasSubstr;
using testing::Not;

class ConformPlain : public CliRig {
 protected:
  void serve(const std::string& fault = "") {
    std::vector<std::string> command{CORBOT_BINARY_DIR "/tests/plain_robot", std::to_string(port_)};
    if (!fault.empty()) command.push_back(fault);
    robot_ = std::make_unique<Process>(command);
    ASSERT_TRUE(robot_->wait_line("serves", within(20)));
  }
  [[nodiscard]] std::string reference() const { return "127.0.0.1:" + std::to_string(port_) + "/plain"; }
  RunResult conform() { return corbot({"conform", reference(), "--yes"}, 120); }

  std::unique_ptr<Process> robot_;
};

TEST_F(ConformPlain, AllThatTheCellNeedsHoldsAndWhatIsNotThereIsNamed) {
  serve();
  const RunResult result = conform();
  EXPECT_EQ(result.code, 0) << result.output << result.errors;
  EXPECT_THAT(result.output, AllOf(Not(HasSubstr("does not hold")),
                                   ContainsRegex("\nnot there +MoveC +[^\n]*NO_IMPLEMENT\n"),
                                   ContainsRegex("\nholds +yes +Move to where it is"),
                                   HasSubstr("All that the pick-and-place cell needs holds.\n")));
}

TEST_F(ConformPlain, WhatThisMachineMeasuredWhileItStoodStillIsMeasuredAgain) {
  serve();
  std::string output;
  for (int tries = 0; tries < 5 && output.find("again           yes   Delay") == std::string::npos; ++tries) {
    const auto conform = begin({"conform", reference(), "--yes"});
    ASSERT_TRUE(conform->wait_line("holds           yes   Speed ", within(60)));
    std::this_thread::sleep_for(std::chrono::milliseconds(400));  // on a busy machine not always within Delay
    conform->signal(SIGSTOP);
    std::this_thread::sleep_for(std::chrono::milliseconds(2500));  // Delay may last 2 s
    conform->signal(SIGCONT);
    const auto status = conform->wait(within(120));
    ASSERT_TRUE(status && WIFEXITED(*status));
    output = conform->output();
    EXPECT_EQ(WEXITSTATUS(*status), 0) << output << conform->errors();
  }
  EXPECT_THAT(output,
              ContainsRegex("\nagain +yes +Delay [^\n]*this machine stood still for [0-9.]+ s: [0-9.]+ s\n"
                            "(again [^\n]*\n)*holds +yes +Delay "));
}

TEST_F(ConformPlain, AMoveThatReturnsBeforeTheArmIsAtRestIsFound) {
  serve("early");
  const RunResult result = conform();
  EXPECT_EQ(result.code, 1);
  EXPECT_THAT(result.output,
              ContainsRegex("\ndoes not hold +yes +Move +[^\n]*the arm moves after the reply: [0-9.]+ mm"));
}

TEST_F(ConformPlain, AnUnreachablePointThatIsAcceptedIsFound) {
  serve("silent");
  const RunResult result = conform();
  EXPECT_EQ(result.code, 1);
  EXPECT_THAT(result.output,
              ContainsRegex("\ndoes not hold +yes +Move, MoveS too far [^\n]*Move was accepted"));
  EXPECT_EQ(result.errors, "corbot: 1 of the checks that the pick-and-place cell needs does not hold\n");
}

TEST_F(ConformPlain, ADelayThatReturnsAtOnceIsFound) {
  serve("hasty");
  const RunResult result = conform();
  EXPECT_EQ(result.code, 1);
  EXPECT_THAT(result.output, ContainsRegex("\ndoes not hold +yes +Delay +1 to 2 s +0\\.[0-9]+ s\n"));
  EXPECT_EQ(result.errors, "corbot: 1 of the checks that the pick-and-place cell needs does not hold\n");
}

TEST_F(ConformPlain, NothingMovesWhereSpeedIsNotThere) {
  serve("full");
  const RunResult result = conform();
  EXPECT_EQ(result.code, 1);
  EXPECT_THAT(result.output, AllOf(ContainsRegex("\nnot there +yes +Speed +[^\n]*NO_IMPLEMENT\n"),
                                   ContainsRegex("\ndoes not hold +yes +Delay +[^\n]*not called: Speed does"),
                                   ContainsRegex("\ndoes not hold +Ready +[^\n]*not called: Speed does")));
}

}  // namespace
}  // namespace corbot::test
