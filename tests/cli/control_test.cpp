// SPDX-License-Identifier: Apache-2.0
// Exclusive control from the command line: what its holder and everyone else gets to see.
#include <gmock/gmock.h>
#include <pwd.h>
#include <unistd.h>

#include "cli_rig.h"

namespace corbot::test {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::Not;
using testing::StartsWith;

class ControlCommands : public CliRig {
 protected:
  void SetUp() override { up(); }
  /// The reference that `acquire` prints, alone on its line.
  std::string acquire(const std::vector<std::string>& options) {
    std::vector<std::string> command{"acquire"};
    command.insert(command.end(), options.begin(), options.end());
    const RunResult result = corbot(command);
    EXPECT_EQ(result.code, 0) << result.errors;
    EXPECT_THAT(result.output, StartsWith("IOR:"));
    return result.output.substr(0, result.output.find('\n'));
  }
  RunResult by(const std::string& reference, std::vector<std::string> command) {
    command.insert(command.end(), {"--robot", reference});
    return corbot(command);
  }
  std::string holder() { return status().at("control").at("holder").get<std::string>(); }
};

/// With the key in it, it is shown as little as a password.
TEST_F(ControlCommands, StatusDoesNotShowTheReference) {
  const std::string mine = acquire({"--lease", "600"});
  for (const std::vector<std::string>& command : {std::vector<std::string>{"status"}, {"status", "--json"}}) {
    const RunResult shown = by(mine, command);
    EXPECT_EQ(shown.code, 0) << shown.errors;
    EXPECT_EQ(shown.output.find("IOR:"), std::string::npos) << shown.output;
  }
}

TEST_F(ControlCommands, EveryCommandWorksThroughTheReference) {
  const std::string mine = acquire({"--lease", "600", "--who", "cell 7"});
  const std::vector<std::vector<std::string>> commands{{"move", "0.22", "-0.08", "0.02", "--above", "0.06"},
                                                       {"moves", "0.22", "-.08", "0.05"},
                                                       {"joints", "-10", "5", "10", "20"},
                                                       {"drive", "0", "-5", "20"},
                                                       {"ready"},
                                                       {"delay", "0.05"},
                                                       {"open"},
                                                       {"close"},
                                                       {"speed", "80", "--all"},
                                                       {"pitch", "-20"},
                                                       {"tool", "0.01", "0", "0"},
                                                       {"base", "0", "0", "0.1"},
                                                       {"frames", "--reset"},
                                                       {"override", "50"},
                                                       {"cancel", "1"},
                                                       {"pause"},
                                                       {"resume"},
                                                       {"renew"}};
  for (const auto& command : commands) {
    const RunResult refused = corbot(command);
    EXPECT_EQ(refused.code, 1) << command[0];
    if (command[0] == "speed" || command[0] == "pitch") {
      EXPECT_THAT(refused.errors,
                  HasSubstr("another client has exclusive control of the arm; 'corbot status' names"));
    } else if (command[0] != "renew") {
      EXPECT_THAT(refused.errors, HasSubstr("'cell 7' has control of the arm, for another ")) << command[0];
    }
    const RunResult done = by(mine, command);
    EXPECT_EQ(done.code, 0) << command[0] << ": " << done.errors;
  }
  EXPECT_EQ(by(mine, {"status"}).code, 0);
  for (const char* command : {"alarms", "diagnostics", "stop", "clear"}) {
    EXPECT_EQ(by(mine, {command}).code, 0) << command;
    EXPECT_EQ(corbot({command}).code, 0) << command << " is everyone's";
  }
  EXPECT_EQ(holder(), "cell 7");
  EXPECT_EQ(by(mine, {"release"}).code, 0);
  EXPECT_EQ(holder(), "");
  const RunResult ended = by(mine, {"drive", "0", "1", "20"});
  EXPECT_EQ(ended.code, 1);
  EXPECT_THAT(ended.errors, HasSubstr("control has ended"));
  EXPECT_THAT(by(mine, {"speed", "80"}).errors, HasSubstr("control has ended"));
  EXPECT_EQ(by(mine, {"stop"}).code, 0);
  EXPECT_EQ(corbot({"drive", "0", "1", "20"}).code, 0);
}

TEST_F(ControlCommands, StatusNamesTheHolder) {
  EXPECT_THAT(corbot({"status"}).output, Not(HasSubstr("control")));
  const std::string mine = acquire({});
  char machine[256] = "";
  ::gethostname(machine, sizeof(machine) - 1);
  const std::string me = std::string(::getpwuid(::geteuid())->pw_name) + "@" + machine;
  EXPECT_EQ(holder(), me.substr(0, 64));
  const auto left_s = status().at("control").at("left_s").get<double>();
  EXPECT_GT(left_s, 0.0);
  EXPECT_LE(left_s, 60.0);
  EXPECT_THAT(corbot({"status"}).output,
              testing::ContainsRegex("\n  control   [^\n]+, [0-9.]+ s left unless renewed\n"));
  EXPECT_THAT(by(mine, {"watch", "--count", "1"}).output, HasSubstr("  control " + me.substr(0, 64)));
  const RunResult second = corbot({"acquire"});
  EXPECT_EQ(second.code, 1);
  EXPECT_THAT(second.errors, HasSubstr("has control of the arm"));
  EXPECT_EQ(second.output, "");
}

TEST_F(ControlCommands, AcquireLeavesMotionsOfOthersAlone) {
  const auto motion = begin({"joints", "80", "20", "30", "40", "--time", "30"});
  ASSERT_TRUE(wait_state("Waiting"));
  const RunResult refused = corbot({"acquire"});
  EXPECT_EQ(refused.code, 1);
  EXPECT_EQ(refused.output, "");
  EXPECT_THAT(refused.errors, HasSubstr("a motion of others is still under way: call again when the arm is "
                                        "at rest, or Stop it"));
  EXPECT_EQ(status().at("state"), "Waiting");
  EXPECT_EQ(holder(), "");
  EXPECT_EQ(corbot({"stop"}).code, 0);
  EXPECT_TRUE(motion->wait(within(30)));
  EXPECT_EQ(by(acquire({}), {"drive", "0", "1", "20"}).code, 0);
}

TEST_F(ControlCommands, HoldLastsUntilClear) {
  const auto motion = begin({"joints", "80", "20", "30", "40", "--time", "30"});
  ASSERT_TRUE(wait_state("Waiting"));
  EXPECT_EQ(corbot({"hold"}).code, 0);
  const auto end = motion->wait(within(30));
  ASSERT_TRUE(end);
  EXPECT_EQ(WEXITSTATUS(*end), 4);
  EXPECT_EQ(status().at("state"), "Error");
  EXPECT_TRUE(status().at("control").at("held").get<bool>());
  EXPECT_THAT(corbot({"status"}).output,
              HasSubstr("  held      by a StopAndHold: nothing moves until 'corbot clear'"));
  EXPECT_EQ(corbot({"ready"}).code, 1);
  EXPECT_EQ(corbot({"clear"}).code, 0);
  EXPECT_EQ(status().at("state"), "Standby");
  EXPECT_FALSE(status().at("control").at("held").get<bool>());
  EXPECT_EQ(corbot({"ready"}).code, 0);
}

/// A hold outlasts down and up: the person who requested it may still stand at the arm.
TEST_F(ControlCommands, AHoldOutlivesTheRobot) {
  EXPECT_EQ(corbot({"hold"}).code, 0);
  EXPECT_EQ(corbot({"down"}).code, 0);
  supervisor_.reset();
  up();
  EXPECT_TRUE(status().at("control").at("held").get<bool>());
  EXPECT_EQ(corbot({"ready"}).code, 1);
  EXPECT_EQ(corbot({"clear"}).code, 0);
  EXPECT_EQ(corbot({"down"}).code, 0);
  supervisor_.reset();
  up();
  EXPECT_FALSE(status().at("control").at("held").get<bool>());
}

/// As every other bad value that is typed: before anything is asked of the robot.
TEST_F(ControlCommands, RefusesWhatIsNoLease) {
  for (const char* lease : {"4000", "0.1", "-1", "0"}) {
    const RunResult refused = corbot({"acquire", "--lease", lease});
    EXPECT_EQ(refused.code, 2) << lease;
    EXPECT_THAT(refused.errors, HasSubstr(std::string("--lease ") + lease + ": must be 0.5 to 3600 seconds"));
  }
  for (const std::string& who : {std::string(65, 'x'), std::string("a\tb")}) {
    const RunResult refused = corbot({"acquire", "--who", who});
    EXPECT_EQ(refused.code, 2) << who;
    EXPECT_THAT(refused.errors, HasSubstr("must be 1 to 64 printable ASCII characters"));
  }
  EXPECT_EQ(corbot({"acquire", "--lease", "soon"}).code, 2);
  EXPECT_EQ(corbot({"renew", "x"}).code, 2);
  for (const char* command : {"renew", "release"}) {
    const RunResult without = corbot({command});
    EXPECT_EQ(without.code, 1) << command;
    EXPECT_THAT(without.errors, HasSubstr("this reference never had control of the arm"));
    EXPECT_THAT(without.errors, Not(HasSubstr("has ended")));
  }
}

TEST_F(ControlCommands, ReleaseAndRenewNeedControlAndNotAReadyRobot) {
  for (const char* command : {"release", "renew"}) {
    const RunResult none = corbot({command});
    EXPECT_EQ(none.code, 1);
    EXPECT_THAT(none.errors, StartsWith("corbot: this reference never had control of the arm"));
  }
}

TEST_F(ControlCommands, ReleaseByForceNeedsNoReference) {
  const RunResult nobody = corbot({"release", "--force"});
  EXPECT_EQ(nobody.code, 1);
  EXPECT_THAT(nobody.errors, HasSubstr("no client has control of the arm"));
  const std::string mine = acquire({"--lease", "600", "--who", "cell 7"});
  const auto motion = begin({"joints", "80", "20", "30", "40", "--time", "30", "--robot", mine});
  ASSERT_TRUE(wait_state("Waiting"));
  const RunResult forced = corbot({"release", "--force"});
  EXPECT_EQ(forced.code, 0) << forced.errors;
  EXPECT_EQ(forced.output, "the control of 'cell 7' has ended, the arm is at rest\n");
  EXPECT_EQ(holder(), "");
  EXPECT_EQ(status().at("state"), "Standby");
  const auto end = motion->wait(within(30));
  ASSERT_TRUE(end);
  EXPECT_EQ(WEXITSTATUS(*end), 4);
  EXPECT_EQ(by(mine, {"drive", "0", "1", "20"}).code, 1);
  EXPECT_EQ(corbot({"drive", "0", "1", "20"}).code, 0);
  const RunResult remote = corbot({"release", "--force", "--robot", "127.0.0.1:1/elsewhere"});
  EXPECT_EQ(remote.code, 2);
  EXPECT_THAT(remote.errors, HasSubstr("on the robot's machine"));
}

}  // namespace
}  // namespace corbot::test
