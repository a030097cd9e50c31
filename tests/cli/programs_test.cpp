// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>
#include <signal.h>
#include <sys/wait.h>

#include <algorithm>
#include <fstream>
#include <sstream>

#include "cli_rig.h"
#include "support/paths.h"

namespace corbot::test {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::Not;

class Programs : public CliRig {
 protected:
  void SetUp() override { up(); }
};

/// The rows of a recording as numbers; the state is left out.
std::vector<std::vector<double>> read_rows(const std::string& file) {
  std::ifstream stream(file);
  std::vector<std::vector<double>> rows;
  std::string line;
  while (std::getline(stream, line) && line.starts_with('#')) {
  }
  while (std::getline(stream, line)) {
    std::vector<double> row;
    std::istringstream fields(line);
    for (std::string field; std::getline(fields, field, ',');)
      row.push_back(std::strtod(field.c_str(), nullptr));
    rows.push_back(row);
  }
  return rows;
}

TEST_F(Programs, TheExampleRunsWhileItIsRecorded) {
  const std::string file = (directory_ / "run.csv").string();
  const auto recorder = begin({"record", file});
  ASSERT_TRUE(wait_until(within(20), [&] { return std::filesystem::exists(file); }));
  const RunResult result = corbot({"run", CORBOT_EXAMPLES "/pick_and_place.corbot"}, 100);
  EXPECT_EQ(result.code, 0) << result.errors;
  EXPECT_THAT(result.output, AllOf(HasSubstr("1/14  line 5: ready"), HasSubstr("done: 14 commands")));
  recorder->signal(SIGINT);
  EXPECT_EQ(recorder->wait(within(20)), 0);
  EXPECT_THAT(recorder->errors(), HasSubstr(", 0 lost"));

  const auto rows = read_rows(file);
  ASSERT_GT(rows.size(), 1000u);
  double lowest_m = 1;
  for (std::size_t i = 1; i < rows.size(); ++i) {
    ASSERT_EQ(rows[i].size(), 29u);
    ASSERT_EQ(rows[i][0], rows[i - 1][0] + 1) << "every cycle once";
    lowest_m = std::min(lowest_m, rows[i][12]);
  }
  EXPECT_NEAR(lowest_m, 0.02, 1e-6) << "the hand was at the part";

  const RunResult drawn = corbot({"plot", file});
  EXPECT_EQ(drawn.code, 0) << drawn.errors;
  EXPECT_EQ(drawn.output, (directory_ / "run.svg").string() + "\n");
  const RunResult piped = corbot({"plot", file, "-o", "-"});
  EXPECT_THAT(piped.output,
              AllOf(HasSubstr("<svg "), HasSubstr(">joint 3 wrist, deg<"), HasSubstr(" cycles, 0 missing")));
  EXPECT_EQ(corbot({"plot", CORBOT_EXAMPLES "/pick_and_place.corbot", "-o", "-"}).code, 2);
}

TEST_F(Programs, AFailingLineStopsTheProgramWithItsNumber) {
  const std::string file = put("p.corbot", "# a program\nready\nmove 2 2 2\njoints 20 0 0 0\n");
  const RunResult result = corbot({"run", file});
  EXPECT_EQ(result.code, 1);
  EXPECT_THAT(result.errors, AllOf(HasSubstr("p.corbot:3: move 2 2 2: "), HasSubstr("out of reach"),
                                   HasSubstr("this command moved nothing"),
                                   HasSubstr("; line 2 was done; line 4 was not begun")));
  EXPECT_NEAR(status().at("joints").at(0).at("value_deg").get<double>(), 0, 1e-9)
      << "the line behind was not begun";
}

TEST_F(Programs, AllSyntaxErrorsAreReportedBeforeAnythingMoves) {
  const std::string file = put("p.corbot", "joints 20 0 0 0\nmove 1\n\ndance\n");
  const RunResult result = corbot({"run", file});
  EXPECT_EQ(result.code, 2);
  EXPECT_THAT(result.errors, AllOf(HasSubstr("p.corbot:2: Y missing"), HasSubstr("p.corbot:4: unknown"),
                                   HasSubstr("2 lines to fix"), HasSubstr("nothing moved")));
  EXPECT_NEAR(status().at("joints").at(0).at("value_deg").get<double>(), 0, 1e-9);
}

TEST_F(Programs, ADryRunMovesNothing) {
  const std::string file = put("p.corbot", "joints 20 0 0 0\nspeed 0.5\n");
  const RunResult result = corbot({"run", file, "--dry-run"});
  EXPECT_THAT(result.errors, HasSubstr("p.corbot:2: note: 0.5 is taken as 0.5 percent"));
  EXPECT_EQ(result.code, 0) << result.errors;
  EXPECT_THAT(result.output, AllOf(HasSubstr("line 1: joints 20 0 0 0"), HasSubstr("the syntax is right"),
                                   HasSubstr("joint names, reach and limits were NOT checked")));
  EXPECT_NEAR(status().at("joints").at(0).at("value_deg").get<double>(), 0, 1e-9);
}

TEST_F(Programs, ADryRunWithAProfileRefusesTheLineThatTheRobotRefuses) {
  const std::string file = put("p.corbot", "limit 0 -10 10\nready\njoints 20 0 0 0\nready\n");
  const RunResult dry = corbot({"run", file, "--dry-run", "--profile", CORBOT_TEST_PROFILE});
  EXPECT_EQ(dry.code, 1);
  EXPECT_THAT(
      dry.errors,
      HasSubstr("p.corbot:3: joints 20 0 0 0: the robot would refuse this line: joint 0 would be at 20"));
  const RunResult real = corbot({"run", file});
  EXPECT_EQ(real.code, 1);
  EXPECT_THAT(real.errors, HasSubstr("p.corbot:3: joints 20 0 0 0: refused: "));
  EXPECT_EQ(corbot({"run", file, "--profile", CORBOT_TEST_PROFILE}).code, 2) << "for a dry run only";
  const RunResult free =
      corbot({"run", put("q.corbot", "ready\n"), "--dry-run", "--profile", CORBOT_TEST_PROFILE});
  EXPECT_THAT(free.output,
              HasSubstr("the planes and boxes that clients have set, and other obstacles were NOT"));
  const std::string picture = (directory_ / "plan.svg").string();
  EXPECT_EQ(corbot({"run", file, "--dry-run", "--plot", picture}).code, 2) << "with a profile only";
  EXPECT_FALSE(std::filesystem::exists(picture));
  const std::string moves = put("q.corbot", "joints 20 0 0 0\n");
  EXPECT_EQ(corbot({"run", moves, "--dry-run", "--profile", CORBOT_TEST_PROFILE, "--plot", picture}).code, 0);
  EXPECT_TRUE(std::filesystem::exists(picture));
}

TEST_F(Programs, OnAPausedArmWaitsAndSaysSo) {
  EXPECT_EQ(corbot({"pause"}).code, 0);
  const auto program = begin({"run", put("p.corbot", "speed 50\njoints 5 0 0 0\n")});
  EXPECT_TRUE(program->wait_line("  the arm is paused; its motions wait until 'corbot resume'", within(20)));
  EXPECT_EQ(corbot({"resume"}).code, 0);
  EXPECT_EQ(program->wait(within(20)), 0);
}

TEST_F(Programs, CtrlCEndsTheProgramAndTheMotion) {
  const std::string file = put("p.corbot", "joints 80 0 0 0 --time 30\njoints 0 0 0 0\nopen\n");
  const auto program = begin({"run", file});
  ASSERT_TRUE(wait_state("Waiting"));
  program->signal(SIGINT);
  const auto end = program->wait(within(20));
  ASSERT_TRUE(end);
  EXPECT_EQ(WEXITSTATUS(*end), 4);
  EXPECT_THAT(program->errors(), AllOf(HasSubstr("p.corbot:1:"), HasSubstr("stopped by Ctrl-C")));
  EXPECT_THAT(program->output(), Not(HasSubstr("2/3")));
  EXPECT_EQ(status().at("state"), "Standby");
}

TEST_F(Programs, RecordingsAreNotOverwrittenUnasked) {
  const std::string file = put("r.csv", "precious\n");
  const RunResult refused = corbot({"record", file, "--for", "0.1"});
  EXPECT_EQ(refused.code, 2);
  EXPECT_THAT(refused.errors, HasSubstr("--force"));
  const RunResult forced = corbot({"record", file, "--for", "0.1", "--force"});
  EXPECT_EQ(forced.code, 0) << forced.errors;
  EXPECT_GT(read_rows(file).size(), 10u);
  const RunResult piped = corbot({"record", "-", "--for", "0.1"});
  EXPECT_THAT(piped.output, testing::StartsWith("# profile '"));
  EXPECT_THAT(piped.output, HasSubstr("# joint 0 'base': -90 to 90 deg, "));
  EXPECT_THAT(piped.output, HasSubstr("\ncycle,time_ns,"));
  EXPECT_EQ(corbot({"record", "/nonexistent/r.csv", "--for", "0.1"}).code, 5);
}

}  // namespace
}  // namespace corbot::test
