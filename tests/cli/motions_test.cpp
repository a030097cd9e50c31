// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>
#include <signal.h>
#include <sys/wait.h>

#include <algorithm>
#include <chrono>
#include <filesystem>
#include <fstream>
#include <iterator>

#include "cli/arm/plan_text.h"
#include "cli_rig.h"
#include "terminal.h"

namespace corbot::test {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::Not;

class Motions : public CliRig {
 protected:
  void SetUp() override { up(); }
  double tool(const char* axis) { return status().at("tool").at(axis).get<double>(); }
  double joint(std::size_t index) { return status().at("joints").at(index).at("value_deg").get<double>(); }
};

TEST_F(Motions, EachCommandReachesTheArm) {
  EXPECT_EQ(status().at("state"), "Standby");
  EXPECT_EQ(corbot({"move", "0.22", "-0.08", "0.02", "--above", "0.06"}).code, 0);
  EXPECT_NEAR(tool("x_m"), 0.22, 1e-9);
  EXPECT_NEAR(tool("y_m"), -0.08, 1e-9);
  EXPECT_NEAR(tool("z_m"), 0.08, 1e-9);
  EXPECT_EQ(corbot({"moves", "0.22", "-.08", "0.05"}).code, 0) << "a negative number without its zero";
  EXPECT_NEAR(tool("z_m"), 0.05, 1e-9);
  EXPECT_EQ(corbot({"movec", "0.22", "-0.08", "0.08", "0.24", "0", "0.12", "0.2", "0.1", "0.08"}).code, 0);
  EXPECT_NEAR(tool("y_m"), 0.1, 1e-9);
  EXPECT_EQ(corbot({"joints", "-10", "5", "10", "20"}).code, 0);
  EXPECT_NEAR(joint(0), -10, 1e-9);
  EXPECT_EQ(corbot({"drive", "0", "-5", "60"}).code, 0);
  EXPECT_NEAR(joint(0), -15, 1e-9);
  EXPECT_EQ(corbot({"drive", "base", "-5", "60"}).code, 0);
  EXPECT_NEAR(joint(0), -20, 1e-9);
  EXPECT_EQ(corbot({"gripper", "0.4"}).errors,
            "corbot: note: 0.4 is taken as 0.4 percent; 40 is 40 percent\n");
  EXPECT_EQ(corbot({"open"}).code, 0);
  EXPECT_EQ(status().at("gripper"), "open");
  EXPECT_EQ(corbot({"close"}).code, 0);
  EXPECT_EQ(status().at("gripper"), "closed");
  EXPECT_EQ(corbot({"override", "50"}).code, 0);
  EXPECT_EQ(status().at("override_percent"), 50.0);
  EXPECT_EQ(corbot({"pitch", "-20"}).code, 0);
  EXPECT_EQ(status().at("tool_pitch_deg"), -20.0);
  EXPECT_EQ(corbot({"speed", "80", "--all"}).code, 0);
  EXPECT_EQ(corbot({"speed", "70", "--joint", "elbow"}).code, 0);
  EXPECT_EQ(corbot({"speed", "50"}).code, 0);
  EXPECT_EQ(corbot({"speed"}).output, "50 %, joint 0 80 %, joint 1 80 %, joint 2 70 %, joint 3 80 %\n");
  EXPECT_EQ(status().at("speed_percent").at("tool"), 50.0);
  EXPECT_THAT(corbot({"drive", "0", "1", "9999"}).errors, HasSubstr("the speed in force is 40 %"));
  EXPECT_EQ(corbot({"delay", "0.05"}).code, 0);
  EXPECT_EQ(corbot({"ready"}).code, 0);
  EXPECT_NEAR(joint(0), 0, 1e-9);
  EXPECT_EQ(corbot({"clear"}).code, 0);
  EXPECT_THAT(corbot({"alarms"}).output, testing::ContainsRegex("^(no alarms|[^\n]* 140 [^\n]*)\n$"))
      << "but overruns";
  EXPECT_THAT(corbot({"diagnostics"}).output, AllOf(HasSubstr("latency"), HasSubstr("4000 us period")));
}

TEST_F(Motions, ATimeThatTheLimitsDoNotAllowIsNamed) {
  const std::string lengthened =
      "--time 0.01: the limits of the arm do not allow so short a time; the robot has planned ";
  for (const std::string command : {"move", "moves"}) {
    const RunResult fast = corbot({command, "0.2", "0.05", "0.08", "--time", "0.01"});
    EXPECT_EQ(fast.code, 0);
    EXPECT_EQ(corbot({command, "0.22", "0.05", "0.08", "--time", "0.01", "--dry-run"})
                  .errors.substr(0, 8 + lengthened.size()),
              "corbot: " + lengthened);
    EXPECT_THAT(fast.errors, testing::ContainsRegex("^corbot: " + lengthened + "[0-9.]+ s\n$"));
    EXPECT_EQ(corbot({"joints", "0", "0", "0", "0", "--time", "3"}).errors, "") << "the arm takes its time";
  }
  const RunResult run = corbot({"run", put("fast.arm", "joints 10 0 0 0 --time 0.01\nready\n")});
  EXPECT_EQ(run.code, 0) << run.errors;
  EXPECT_THAT(run.output, testing::ContainsRegex("1/2 [^\n]*\n  " + lengthened + "[0-9.]+ s\n2/2 "));
}

TEST_F(Motions, ADryRunShowsThePlanAndMovesNothing) {
  EXPECT_EQ(corbot({"move", "0.22", "-0.08", "0.08"}).code, 0);
  const nlohmann::json before = status().at("joints");
  const RunResult line = corbot({"moves", "0.22", "0.08", "0.08", "--dry-run"});
  EXPECT_EQ(line.code, 0) << line.errors;
  EXPECT_THAT(line.output, testing::ContainsRegex("^  [0-9.]+ s; (joint [0-3]|tool) [a-z]+ 0.00-[0-9.]+ s"));
  EXPECT_EQ(corbot({"joints", "0", "0", "0", "0", "--time", "9", "--dry-run"}).output,
            "  9.00 s; the wanted time\n");
  EXPECT_THAT(corbot({"drive", "base", "10", "180", "--dry-run"}).output, HasSubstr("joint 0"));
  EXPECT_THAT(corbot({"moverelative", "0", "0", "0.01", "--line", "--dry-run"}).output, HasSubstr(" s; "));
  const std::string picture = (directory_ / "plan.svg").string();
  const auto draw = [&](const std::string& x) {
    return corbot(
        {"moves", x, "0.08", "0.08", "--dry-run", "--profile", CORBOT_TEST_PROFILE, "--plot", picture});
  };
  EXPECT_EQ(draw("0.22").code, 0);
  EXPECT_TRUE(std::filesystem::remove(picture));
  const RunResult unnamed =
      corbot({"moves", "0.22", "0.08", "0.08", "--dry-run", "--profile", CORBOT_TEST_PROFILE, "--plot", "-"});
  EXPECT_EQ(unnamed.code, 2);
  EXPECT_THAT(unnamed.errors, HasSubstr("is not the name of a file"));
  EXPECT_EQ(corbot({"speed", "50"}).code, 0);
  EXPECT_THAT(draw("0.22").errors, HasSubstr("the robot plans"));
  EXPECT_FALSE(std::filesystem::exists(picture));
  EXPECT_EQ(corbot({"speed", "100"}).code, 0);
  EXPECT_EQ(corbot({"tool", "0.02", "0", "0"}).code, 0);
  const RunResult other = corbot({"moves", "0.22", "0.08", "0.08", "--time", "9", "--dry-run", "--profile",
                                  CORBOT_TEST_PROFILE, "--plot", picture});
  EXPECT_EQ(other.code, 2) << "as long, and elsewhere";
  EXPECT_THAT(other.errors,
              testing::ContainsRegex(
                  "the motion ends at -?[0-9.]+ of joint [0-3], but the robot plans -?[0-9.]+\\."));
  EXPECT_FALSE(std::filesystem::exists(picture));
  EXPECT_EQ(corbot({"frames", "--reset"}).code, 0);
  const RunResult beyond = corbot({"moves", "2", "0", "0.1", "--dry-run"});
  EXPECT_EQ(beyond.code, 1);
  EXPECT_EQ(beyond.errors, corbot({"moves", "2", "0", "0.1"}).errors);
  EXPECT_EQ(corbot({"open", "--dry-run"}).code, 2) << "no motion of the arm";
  EXPECT_EQ(status().at("joints"), before);
}

TEST_F(Motions, ARobotElsewhereIsAskedForTheReachOfACell) {
  for (const auto& entry : std::filesystem::directory_iterator(CORBOT_CELL))
    std::filesystem::copy(entry.path(), directory_);
  const std::string file = directory_ / "cell.toml";
  std::ifstream in(file);
  std::string text{std::istreambuf_iterator<char>(in), {}};
  const auto replace = [&](const std::string& from, const std::string& to) {
    const auto at = text.find(from);
    ASSERT_NE(at, std::string::npos) << from;
    text.replace(at, from.size(), to);
  };
  const nlohmann::json before = status().at("joints");
  replace("profile = \"arm.toml\"",
          "reference = \"corbaloc::127.0.0.1:" + std::to_string(port_) + "/" + name_ + "\"");
  std::ofstream(file) << text;
  const RunResult all = corbot({"cell", "check", file});
  EXPECT_EQ(all.code, 0) << all.errors;
  EXPECT_EQ(all.output,
            "robot1: all 27 points are reached from where it stands\nrobot2: all 33 points are reached\n");
  replace("wait_m = [0.153", "wait_m = [0.9");
  std::ofstream(file) << text;
  const RunResult refused = corbot({"cell", "check", file});
  EXPECT_EQ(refused.code, 1);
  EXPECT_THAT(refused.output, HasSubstr("robot1: robot[0].wait_m: the motion to "));
  EXPECT_THAT(refused.output, HasSubstr("would be refused: "));
  EXPECT_EQ(status().at("joints"), before) << "nothing moves";
}

TEST_F(Motions, ConformFindsThatAllOfRobotIdlHolds) {
  EXPECT_EQ(corbot({"speed", "60"}).code, 0);
  const RunResult result =
      corbot({"conform", "127.0.0.1:" + std::to_string(port_) + "/" + name_, "--yes"}, 120);
  EXPECT_EQ(result.code, 0) << result.output << result.errors;
  EXPECT_THAT(result.output, AllOf(Not(HasSubstr("does not hold")), Not(HasSubstr("not there"))));
  EXPECT_EQ(status().at("speed_percent").at("tool"), 60.0);
  EXPECT_THAT(corbot({"alarms"}).output, testing::ContainsRegex("^(no alarms\n|([^\n]* 140 [^\n]*\n)+)$"))
      << "apart from missed periods, of which each minute has a line";
}

TEST_F(Motions, ConformMovesNothingUntilYesIsTyped) {
  const nlohmann::json before = status().at("joints");
  EXPECT_THAT(corbot({"conform", name_}).errors,
              HasSubstr("standard input is no terminal for the question: give --yes to agree"));
  const Terminal operator_side;
  const auto asked = begin({"conform", name_}, operator_side.path());
  operator_side.type("y");
  const auto end = asked->wait(within(20));
  ASSERT_TRUE(end);
  EXPECT_EQ(WEXITSTATUS(*end), 2);
  EXPECT_THAT(asked->output(), HasSubstr("This moves the arm"));
  EXPECT_EQ(status().at("joints"), before);
}

TEST_F(Motions, CtrlCEndsConformAndLeavesTheSpeedAsItWas) {
  const auto examined = begin({"conform", name_, "--yes"});
  ASSERT_TRUE(wait_state("Waiting"));
  examined->signal(SIGINT);
  const auto end = examined->wait(within(20));
  ASSERT_TRUE(end);
  EXPECT_EQ(WEXITSTATUS(*end), 4);
  EXPECT_THAT(examined->errors(), HasSubstr("the examination was ended by Ctrl-C"));
  EXPECT_EQ(status().at("state"), "Standby");
  EXPECT_EQ(status().at("speed_percent").at("tool"), 100.0);
}

TEST_F(Motions, FramesAreSetShownAndReset) {
  EXPECT_EQ(corbot({"move", "0.22", "0", "0.1"}).code, 0);
  EXPECT_EQ(corbot({"tool", "0.05", "0", "0", "0.70710678118654757", "-0.70710678118654757", "0", "0"}).code,
            0);
  EXPECT_NEAR(tool("x_m"), 0.27, 1e-9);
  const RunResult set = corbot({"base", "2", "-1", "0.5"});
  EXPECT_EQ(set.code, 0) << set.errors;
  EXPECT_THAT(set.output,
              HasSubstr("base  2 -1 0.5 m, orientation 1 0 0 0\n'corbot frames --reset' restores"));
  EXPECT_NEAR(tool("x_m"), 2.27, 1e-9);
  EXPECT_EQ(corbot({"moves", "2.27", "-0.95", "0.6"}).code, 0);
  EXPECT_NEAR(tool("y_m"), -0.95, 1e-9);
  EXPECT_EQ(corbot({"frames"}).output,
            "tool  0.05 0 0 m, orientation 0.707106781 -0.707106781 0 0\n"
            "base  2 -1 0.5 m, orientation 1 0 0 0\n");
  const RunResult solutions = corbot({"solutions", "2.27", "-0.95", "0.6"});
  EXPECT_EQ(solutions.code, 0) << solutions.errors;
  EXPECT_THAT(solutions.output, HasSubstr(" 0* "));
  const auto json = nlohmann::json::parse(corbot({"solutions", "2.27", "-0.95", "0.6", "--json"}).output);
  EXPECT_EQ(json.at("in_use"), 0);
  EXPECT_EQ(json.at("solutions").at(0).at("within_limits"), true);
  EXPECT_NEAR(json.at("solutions").at(0).at("joints").at(0).get<double>(), joint(0), 1e-6);
  EXPECT_EQ(corbot({"solutions", "9", "0", "0"}).code, 1);
  EXPECT_EQ(corbot({"solutions", "2", "0", "0", "1"}).code, 2);
  EXPECT_EQ(corbot({"tool", "0.05", "0", "0", "1"}).code, 2);
  const RunResult refused = corbot({"tool", "50", "0", "0"});
  EXPECT_EQ(refused.code, 1);
  EXPECT_THAT(refused.errors, HasSubstr("50 m, allowed -10 to 10 m"));
  EXPECT_EQ(corbot({"frames", "--reset"}).code, 0);
  EXPECT_THAT(corbot({"frames"}).output, HasSubstr("tool  0 0 0 m"));
}

TEST_F(Motions, PlanesAndBoxesAreSetShownAndRemoved) {
  ASSERT_EQ(corbot({"workspace", "low", "0", "0", "2", "0.04", "--parts", "tool"}).code, 0);
  ASSERT_EQ(corbot({"workspace", "post", "2", "2", "1", "1", "1", "0"}).code, 0);
  ASSERT_EQ(corbot({"workspace", "cage", "-3", "-3", "-1", "3", "3", "3", "--within"}).code, 0);
  EXPECT_EQ(corbot({"workspace"}).output,
            "set      low  beyond 0.04 m along 0 0 1, for tool\n"
            "set      post  out of 1 1 0 to 2 2 1 m, for tool, wrist, elbow\n"
            "set      cage  within -3 -3 -1 to 3 3 3 m, for tool, wrist, elbow\n");
  const RunResult refused = corbot({"drive", "1", "-10", "60"});
  EXPECT_EQ(refused.code, 1);
  EXPECT_THAT(refused.errors, HasSubstr("below 'low'"));
  EXPECT_EQ(corbot({"drive", "1", "-10", "60", "--dry-run"}).errors, refused.errors);
  EXPECT_THAT(corbot({"workspace", "wide", "0", "0", "1", "-1", "--parts", "tool,links"}).errors,
              ::testing::StartsWith(
                  "corbot: refused: 'wide': parts tool, upper arm, forearm, hand: the profile gives no"));
  EXPECT_THAT(corbot({"workspace", "low", "0", "0", "1", "0.5"}).errors,
              HasSubstr("beyond the wanted 'low'"));
  EXPECT_THAT(corbot({"workspace", "wall", "--remove"}).errors, HasSubstr("no plane or box 'wall'"));
  EXPECT_EQ(corbot({"workspace", "cage", "--remove"}).code, 0);
  EXPECT_EQ(corbot({"workspace", "low", "0", "0", "1", "0"}).code, 0);
  EXPECT_THAT(corbot({"workspace"}).output, HasSubstr("low  beyond 0 m along 0 0 1, for tool, wrist, elbow"));
  EXPECT_EQ(corbot({"workspace", "--reset"}).code, 0);
  EXPECT_THAT(corbot({"workspace"}).output, HasSubstr("the arm may be anywhere"));
}

TEST_F(Motions, SpeedSlowsDownWhatItNames) {
  const auto seconds = [&](const std::vector<std::string>& motion) {
    const auto begin = std::chrono::steady_clock::now();
    EXPECT_EQ(corbot(motion).code, 0);
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  };
  // Lower bounds only, from the profile's limits: 180 degrees/s of the base, 0.25 m/s of the tool.
  EXPECT_EQ(corbot({"speed", "10", "--all"}).code, 0);
  EXPECT_GT(seconds({"joints", "30", "0", "0", "0"}), 30 / 18.0);
  EXPECT_EQ(corbot({"speed", "100", "--all"}).code, 0);
  EXPECT_EQ(corbot({"speed", "10", "--joint", "0"}).code, 0);
  EXPECT_GT(seconds({"joints", "0", "0", "0", "0"}), 30 / 18.0);
  EXPECT_EQ(corbot({"speed", "100", "--joint", "0"}).code, 0);
  EXPECT_EQ(corbot({"move", "0.22", "0", "0.08"}).code, 0);
  EXPECT_EQ(corbot({"speed", "10"}).code, 0);
  EXPECT_GT(seconds({"moves", "0.22", "0", "0.04"}), 0.04 / 0.025);
  EXPECT_EQ(status().at("override_percent"), 100.0) << "it is no override";
}

TEST_F(Motions, StopFromAnotherProcess) {
  const auto motion = begin({"joints", "80", "20", "30", "40", "--time", "30"});
  ASSERT_TRUE(wait_state("Waiting"));
  EXPECT_EQ(corbot({"stop"}).code, 0);
  const auto end = motion->wait(within(20));
  ASSERT_TRUE(end);
  EXPECT_EQ(WEXITSTATUS(*end), 4);
  EXPECT_THAT(motion->errors(), HasSubstr("stopped before its end"));
  EXPECT_EQ(status().at("state"), "Standby");
  EXPECT_LT(joint(0), 79);
}

TEST_F(Motions, SigtermStopsTheArmAndIsNotReportedAsCtrlC) {
  const auto motion = begin({"joints", "80", "20", "30", "40", "--time", "30"});
  ASSERT_TRUE(wait_state("Waiting"));
  motion->signal(SIGTERM);
  const auto end = motion->wait(within(20));
  ASSERT_TRUE(end);
  EXPECT_EQ(WEXITSTATUS(*end), 4);
  EXPECT_THAT(motion->errors(), AllOf(HasSubstr("stopped by SIGTERM"), Not(HasSubstr("Ctrl-C"))));
}

TEST_F(Motions, AHangUpUnderNohupStopsNothing) {
  const auto motion = begin_in({"/bin/sh", "-c", "trap '' HUP; exec \"$@\"", "sh"},
                               {"joints", "10", "0", "0", "0", "--time", "2"});
  ASSERT_TRUE(wait_state("Waiting"));
  motion->signal(SIGHUP);
  EXPECT_EQ(motion->wait(within(20)), 0) << motion->errors();
}

TEST_F(Motions, CtrlCStopsTheArm) {
  const auto motion = begin({"joints", "80", "20", "30", "40", "--time", "30"});
  ASSERT_TRUE(wait_state("Waiting"));
  motion->signal(SIGINT);
  const auto end = motion->wait(within(20));
  ASSERT_TRUE(end);
  EXPECT_EQ(WEXITSTATUS(*end), 4);
  EXPECT_THAT(motion->errors(), AllOf(HasSubstr("stopping the arm"), HasSubstr("stopped by Ctrl-C")));
  EXPECT_EQ(status().at("state"), "Standby") << "at rest when the command has ended";
  const double rest = joint(0);
  EXPECT_LT(rest, 79);
  EXPECT_EQ(joint(0), rest);
}

/// As where the terminal is closed, or standard error goes to a pipe whose reader Ctrl-C ends, too.
TEST_F(Motions, ASignalStopsTheArmWhereNothingCanBePrinted) {
  for (const int signal : {SIGINT, SIGHUP}) {
    ASSERT_EQ(corbot({"joints", "0", "0", "0", "0"}).code, 0);
    const auto motion = begin({"joints", "80", "20", "30", "40", "--time", "30"});
    ASSERT_TRUE(wait_state("Waiting"));
    motion->close_errors();
    motion->signal(signal);
    const auto end = motion->wait(within(20));
    ASSERT_TRUE(end);
    EXPECT_TRUE(WIFEXITED(*end)) << "signal " << WTERMSIG(*end);
    EXPECT_EQ(WEXITSTATUS(*end), 4);
    EXPECT_EQ(status().at("state"), "Standby") << "at rest when the command has ended";
    EXPECT_LT(joint(0), 79);
  }
}

/// More than there are places for waiting calls: each says what became of its own motion.
TEST_F(Motions, OfManyAtOnceEachEndsAsItsMotionDoes) {
  std::vector<std::unique_ptr<Process>> drives;
  for (int i = 0; i < 6; ++i) drives.push_back(begin({"drive", "0", "5", "20"}));
  for (const auto& drive : drives) {
    const auto end = drive->wait(within(60));
    ASSERT_TRUE(end);
    EXPECT_EQ(WEXITSTATUS(*end), 0) << drive->errors();
  }
  EXPECT_NEAR(joint(0), 30, 1e-9);
}

TEST_F(Motions, CancelTakesBackOneMotionAndWhatIsBehindIt) {
  EXPECT_EQ(corbot({"pause"}).code, 0);
  const auto first = begin({"drive", "0", "5", "20"});
  ASSERT_TRUE(wait_until(within(20), [&] {
    return first->errors().find("its motions wait until 'corbot resume'") != std::string::npos;
  }));
  EXPECT_EQ(corbot({"cancel", "1"}).code, 0);
  const auto end = first->wait(within(20));
  ASSERT_TRUE(end);
  EXPECT_EQ(WEXITSTATUS(*end), 4);
  EXPECT_THAT(first->errors(), HasSubstr("taken back by Cancel"));
  EXPECT_EQ(status().at("paused"), true);
  EXPECT_THAT(corbot({"status"}).output, HasSubstr("paused"));
  EXPECT_EQ(corbot({"stop"}).code, 0);
  EXPECT_EQ(status().at("paused"), true) << "a Stop is no Resume";
  EXPECT_EQ(corbot({"resume"}).code, 0);
  EXPECT_EQ(joint(0), 0);
  const RunResult none = corbot({"cancel", "99"});
  EXPECT_EQ(none.code, 1);
  EXPECT_THAT(none.errors, HasSubstr("motion 99 is unknown"));
}

TEST_F(Motions, PauseHoldsAndResumeGoesOn) {
  const auto motion = begin({"joints", "10", "0", "0", "0", "--time", "3"});
  ASSERT_TRUE(wait_state("Waiting"));
  EXPECT_EQ(corbot({"pause"}).code, 0);
  // Slowed down: two reads of the same position.
  ASSERT_TRUE(wait_until(within(20), [&] {
    const double first = joint(0);
    return joint(0) == first;
  }));
  EXPECT_LT(joint(0), 9.99);
  EXPECT_TRUE(motion->running());
  EXPECT_EQ(corbot({"resume"}).code, 0);
  EXPECT_EQ(motion->wait(within(30)), 0);
  EXPECT_NEAR(joint(0), 10, 1e-9);
}

TEST_F(Motions, RefusalsExplainAndMoveNothing) {
  const auto before = status().at("joints");
  const std::vector<std::tuple<std::vector<std::string>, int, const char*>> cases{
      {{"move", "1", "1", "1"}, 1, "out of reach"},
      {{"move", "0", "0", "0.1"}, 1, "refused: "},
      {{"drive", "9", "1", "1"}, 1, "refused: joint 9, allowed 0 to 3;"},
      {{"drive", "bse", "1", "1"}, 2, "did you mean 'base'?"},
      {{"drive", "0", "200", "20"}, 1, "not within -90 to 90"},
      {{"drive", "0", "20", "9999"}, 1, "9999"},
      {{"joints", "1", "2"}, 1, "refused: target has 2 values, but the arm has 4 joints"},
      {{"movec", "0", "0", "0", "1", "1", "1", "2", "2", "2"}, 1, "line"},
      {{"move", "0.2", "0"}, 2, "Z missing"},
      {{"move", "0.2", "0", "nan"}, 2, "not a finite number"},
      {{"move", "0.2", "0", "x"}, 2, "'x' is not a number"},
      {{"move", "0.2", "0", "0.1", "--time", "-1"}, 2, "must not be negative"},
      {{"move", "0.2", "0", "0.1", "--fast"}, 2, "--fast"},
      {{"speed", "0"}, 2, "above 0"},
      {{"speed", "101"}, 2, "at most 100"},
      {{"delay", "-1"}, 2, "must not be negative"},
      {{"dance"}, 2, "unknown command 'dance'"},
      {{"mov", "1", "2", "3"}, 2, "did you mean 'move'?"},
      {{}, 2, "corbot: a command is missing: type one, such as 'corbot status'"},
      {{"cell"}, 2, "corbot cell: a command is missing: type one, such as 'corbot cell status CELL'"},
      {{"status", "--robot", "127.0.0.1:1/x"}, 3, "no servant at 127.0.0.1:1"},
      {{"status", "--robot", "nobody"}, 3, "no robot named 'nobody'"},
      {{"status", "--robot", "127.0.0.1:" + std::to_string(port_) + "/nobody"},
       3,
       "no robot named 'nobody'"}};
  for (const auto& [arguments, code, phrase] : cases) {
    const RunResult result = corbot(arguments);
    EXPECT_EQ(result.code, code) << phrase << ": " << result.errors;
    EXPECT_THAT(result.errors, AllOf(HasSubstr(phrase), Not(HasSubstr("CORBA")))) << phrase;
  }
  EXPECT_EQ(status().at("joints"), before);
}

TEST_F(Motions, WatchPrintsALineEach) {
  const RunResult result = corbot({"watch", "--count", "3", "--interval", "0.02"});
  EXPECT_EQ(result.code, 0) << result.errors;
  EXPECT_EQ(std::count(result.output.begin(), result.output.end(), '\n'), 3);
  const auto endless = begin({"watch", "--interval", "0.02"});
  ASSERT_TRUE(endless->wait_line("Standby", within(20)));
  endless->signal(SIGINT);
  EXPECT_EQ(endless->wait(within(20)), 0);
}

TEST(PlanText, LimitMetTwiceIsNotShownBetween) {
  const rate::Reason acceleration{rate::Mover::kToolTravel, 0, rate::LimitKind::kAcceleration};
  const rate::Reason jerk{rate::Mover::kToolTravel, 0, rate::LimitKind::kJerk};
  rate::PlanPart part;
  part.duration_s = 1.0;
  part.moves_arm = true;
  part.stretches = {{acceleration, 0.0, 0.3, 0.0, 0.3, 0.93},
                    {jerk, 0.3, 0.7, 0.3, 0.7, 0.89},
                    {acceleration, 0.7, 1.0, 0.7, 1.0, 0.93}};
  EXPECT_EQ(cli::plan_text({part}, client::Verb::kMoveS),
            "  1.00 s; tool acceleration 0.00-0.30 s, tool acceleration 0.70-1.00 s\n");
}

}  // namespace
}  // namespace corbot::test
