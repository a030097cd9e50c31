// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <cmath>
#include <set>
#include <vector>

#include "cli/run_program.h"
#include "client/client.h"
#include "client/failure.h"
#include "client/program.h"
#include "support/paths.h"

namespace corbot::cli {

using client::describe_faults;
using client::describe_others;
using client::ExitCode;
using client::Failure;
using client::find_verb;
using client::parse_program;
using client::parse_request;
using client::Program;
using client::ratio_note;
using client::Request;
using client::spec_of;
using client::to_string;
using client::Verb;
using client::verbs;
using client::VerbSpec;

namespace {

using testing::ElementsAre;
using testing::HasSubstr;

Request only_request(const std::string& line) {
  const Program program = parse_program(line);
  EXPECT_TRUE(program.faults.empty()) << line << ": " << describe_faults(program, "f");
  return program.statements.empty() ? Request{} : program.statements.at(0).request;
}

TEST(Program, ReadsEveryCommand) {
  EXPECT_THAT(only_request("move 0.2 -0.1 .05").numbers, ElementsAre(0.2, -0.1, 0.05));
  const Request moves = only_request("moves 0.2 0 0.1 --above -0.05 --time 2");
  EXPECT_EQ(moves.verb, Verb::kMoveS);
  EXPECT_EQ(moves.above_m, -0.05);
  EXPECT_EQ(moves.time_s, 2.0);
  EXPECT_EQ(only_request("movec 1 2 3 4 5 6 7 8 9").numbers.size(), 9u);
  EXPECT_THAT(only_request("drive 0 -10 20").numbers, ElementsAre(0, -10, 20));
  EXPECT_EQ(only_request("joints 1 2 3 4 --time 1").numbers.size(), 4u);
  EXPECT_EQ(only_request("ready").verb, Verb::kReady);
  EXPECT_THAT(only_request("delay 0.5").numbers, ElementsAre(0.5));
  EXPECT_EQ(only_request("open").verb, Verb::kOpen);
  EXPECT_EQ(only_request("close").verb, Verb::kClose);
  EXPECT_EQ(only_request("gripper 40").verb, Verb::kGripper);
  EXPECT_THAT(only_request("gripper 0").numbers, ElementsAre(0));
  EXPECT_EQ(only_request("speed 50 --joint 2").joint, 2);
  EXPECT_TRUE(only_request("speed 50 --all").all);
  EXPECT_EQ(only_request("pitch -30").verb, Verb::kPitch);
  EXPECT_EQ(only_request("tool 0 0 0.1").numbers.size(), 3u);
  EXPECT_EQ(only_request("base 1 2 3 1 0 0 0").verb, Verb::kBase);
  EXPECT_TRUE(only_request("frames --reset").reset);
  EXPECT_EQ(only_request("override 100").verb, Verb::kOverride);
  EXPECT_THAT(only_request("limit 0 -45 45").numbers, ElementsAre(0, -45, 45));
  EXPECT_TRUE(only_request("limit --reset").reset);
}

TEST(Program, ReadsPosesOffsetsAndOrientations) {
  const Request pose = only_request("movepose 0.2 0 0.1 90 -30 0 --line --time 2");
  EXPECT_EQ(pose.verb, Verb::kMovePose);
  EXPECT_THAT(pose.numbers, ElementsAre(0.2, 0, 0.1, 90, -30, 0));
  EXPECT_TRUE(pose.line);
  EXPECT_EQ(pose.time_s, 2.0);
  EXPECT_FALSE(only_request("movepose 0.2 0 0.1 1 0 0 0").line);
  const Request offset = only_request("moverelative 0 0 -0.05 --tool --line");
  EXPECT_EQ(offset.verb, Verb::kMoveRelative);
  EXPECT_THAT(offset.numbers, ElementsAre(0, 0, -0.05));
  EXPECT_TRUE(offset.tool);
  EXPECT_FALSE(only_request("moverelative 0 0 0 10 0 0").tool);
  EXPECT_EQ(only_request("orientation 10 20 30").verb, Verb::kOrientation);
  EXPECT_EQ(only_request("orientation 0 1 0 0").numbers.size(), 4u);
  EXPECT_TRUE(only_request("orientation --reset").reset);
}

TEST(Program, ThreeAnglesAreTheOnesThatStatusShows) {
  using client::orientation_of;
  const auto expect = [](const Corbot::Quaternion& q, double w, double x, double y, double z) {
    EXPECT_NEAR(q.w, w, 1e-15);
    EXPECT_NEAR(q.x, x, 1e-15);
    EXPECT_NEAR(q.y, y, 1e-15);
    EXPECT_NEAR(q.z, z, 1e-15);
  };
  const double half = std::sqrt(0.5);
  const std::vector<double> none;
  expect(orientation_of(none), 1, 0, 0, 0);
  expect(orientation_of(std::vector<double>{90, 0, 0}), half, 0, 0, half);
  expect(orientation_of(std::vector<double>{0, 90, 0}), half, 0, -half, 0);  // the tool's x axis upward
  expect(orientation_of(std::vector<double>{0, 0, 90}), half, half, 0, 0);
  expect(orientation_of(std::vector<double>{0.6, 0, 0.8, 0}), 0.6, 0, 0.8, 0);
  const double turned = 30.0 * M_PI / 180.0;  // about the new axes, one after the other
  const auto half_sine = std::sin(turned / 2), half_cosine = std::cos(turned / 2);
  expect(orientation_of(std::vector<double>{180, 30, 0}), 0, half_sine, 0, half_cosine);
}

TEST(Program, CountsLinesOverCommentsBlanksAndCarriageReturns) {
  const Program program = parse_program("\xef\xbb\xbf# head\r\n\r\n  ready  # go\r\n\topen\r\n\nclose");
  ASSERT_TRUE(program.faults.empty()) << describe_faults(program, "f");
  ASSERT_EQ(program.statements.size(), 3u);
  EXPECT_EQ(program.statements[0].line, 3u);
  EXPECT_EQ(program.statements[0].text, "ready");
  EXPECT_EQ(program.statements[1].line, 4u);
  EXPECT_EQ(program.statements[2].line, 6u);
}

TEST(Program, OfManyFaultsTheFirstAreShown) {
  std::string text;
  for (int line = 0; line < 30; ++line) text += "dance\n";
  Program program = parse_program(text + "ready\n");
  program.name = "p";
  try {
    client::check_program(program);
    FAIL();
  } catch (const client::Failure& failure) {
    EXPECT_THAT(failure.what(),
                testing::AllOf(HasSubstr("p:20: "), testing::Not(HasSubstr("p:21: ")),
                               testing::EndsWith("\n30 lines to fix, of which 20 are shown; nothing moved")));
  }
}

struct FaultCase {
  const char* line;
  const char* reason;
};

class EveryFault : public testing::TestWithParam<FaultCase> {};

TEST_P(EveryFault, IsReportedWithItsLine) {
  const Program program = parse_program(std::string("# one\nready\n") + GetParam().line + "\nopen\n");
  ASSERT_EQ(program.faults.size(), 1u) << GetParam().line;
  EXPECT_EQ(program.faults[0].line, 3u);
  EXPECT_THAT(program.faults[0].reason, HasSubstr(GetParam().reason));
  EXPECT_THAT(describe_faults(program, "p.corbot"), testing::StartsWith("p.corbot:3: "));
  EXPECT_EQ(program.statements.size(), 2u) << "the other lines are still read";
}

INSTANTIATE_TEST_SUITE_P(
    Program, EveryFault,
    testing::Values(
        FaultCase{"mov 1 2 3", "did you mean 'move'"}, FaultCase{"dance", "unknown command 'dance'"},
        FaultCase{"move 1 2", "Z missing"}, FaultCase{"move", "X missing"},
        FaultCase{"move 1 2 3 4", "unexpected '4'"}, FaultCase{"move 1 2 x", "Z: 'x' is not a number"},
        FaultCase{"move 1 2 nan", "not a finite number"}, FaultCase{"move 1 inf 3", "not a finite number"},
        FaultCase{"move 1,5 2 3", "decimal point"}, FaultCase{"move 1 2 3 --time", "needs a value"},
        FaultCase{"move 1 2 3 --time -1", "must not be negative"},
        FaultCase{"move 1 2 3 --above x", "--above: 'x' is not a number"},
        FaultCase{"cancel 9223372036854775807", "the largest is 9007199254740992"},
        FaultCase{"cancel 0", "must be a positive integer"},
        FaultCase{"move 1 2 3 --speed 4", "no option '--speed'"},
        FaultCase{"movec 1 2 3 4 5 6 7 8", "Z3 missing"}, FaultCase{"joints", "A0 missing"},
        FaultCase{"joints 1 2 3 4 5 6 7", "unexpected '7'"}, FaultCase{"drive -1 10 10", "JOINT '-1'"},
        FaultCase{"drive 1.5 10 10", "JOINT '1.5'"}, FaultCase{"drive 1 10", "SPEED missing"},
        FaultCase{"delay", "SECONDS missing"}, FaultCase{"delay -1", "must not be negative"},
        FaultCase{"ready now", "unexpected 'now'"}, FaultCase{"speed", "PERCENT missing"},
        FaultCase{"frames", "--reset is missing"}, FaultCase{"speed 0", "above 0 and at most 100"},
        FaultCase{"speed 101", "above 0 and at most 100"}, FaultCase{"speed 50 --joint -1", "--joint -1"},
        FaultCase{"speed 50 --joint 1 --all", "give either --joint or --all"},
        FaultCase{"gripper 101", "must be 0 to 100"}, FaultCase{"limit 0 -45", "either JOINT LOWER UPPER"},
        FaultCase{"limit --reset 0 1 2", "or --reset alone"}, FaultCase{"limit 0 45 -45", "is above"},
        FaultCase{"movepose 1 2 3 4 5", "C|QY missing"},
        FaultCase{"movepose 1 2 3 4 5 6 7 8", "unexpected '8'"},
        FaultCase{"movepose 1 2 3 4 5 6 --tool", "no option '--tool'"},
        FaultCase{"moverelative 1 2", "DZ missing"},
        FaultCase{"moverelative 1 2 3 4",
                  "after DZ three angles A B C, a quaternion QW QX QY QZ, or nothing"},
        FaultCase{"orientation 1 2", "write three angles A B C, a quaternion QW QX QY QZ, or --reset alone"},
        FaultCase{"orientation 1 2 3 --reset", "--reset alone"}, FaultCase{"orientation", "--reset alone"},
        FaultCase{"limit 0.5 0 1", "JOINT '0.5'"}, FaultCase{"gripper -1", "must be 0 to 100"},
        FaultCase{"override 0", "above 0 and at most 100"}, FaultCase{"pitch", "DEGREES missing"},
        FaultCase{"tool 0 0", "Z missing"},
        FaultCase{"base 0 0 0 1 0 0", "either X Y Z, or X Y Z QW QX QY QZ"},
        FaultCase{"wait 1", "did you mean 'delay'"}, FaultCase{"goto 1 2 3", "did you mean 'move'"},
        FaultCase{"Ready", "did you mean 'ready'"}, FaultCase{"gripper close", "0 is closed, 100 open"},
        FaultCase{"drive -x 1 1", "a joint's number, from 0, or its name"},
        FaultCase{"stop", "not for programs"}, FaultCase{"pause", "not for programs"},
        FaultCase{"resume", "not for programs"}, FaultCase{"clear", "not for programs"},
        FaultCase{"open \x01", "control character"}, FaultCase{"MOVE 1 2 3", "unknown command"}));

TEST(Program, ReportsAllFaultsInOrder) {
  const Program program = parse_program("dance\nready\nmove 1\n");
  ASSERT_EQ(program.faults.size(), 2u);
  EXPECT_EQ(program.faults[0].line, 1u);
  EXPECT_EQ(program.faults[1].line, 3u);
}

TEST(Program, AFileWithoutAnyCommandIsNotListedWhole) {
  std::string text;
  for (int i = 0; i < 30; ++i) text += "dance\n";
  const auto shown = [](const Program& program) {
    const std::string faults = describe_faults(program, "f");
    return std::count(faults.begin(), faults.end(), '\n');
  };
  EXPECT_EQ(shown(parse_program(text)), 3);
  EXPECT_EQ(shown(parse_program(text + "ready\n")), 20);
}

TEST(Program, APercentageThatReadsAsARatioIsNoted) {
  for (const char* line : {"gripper 0.4", "speed 0.4", "override 0.4", "speed 0.4 --all"})
    EXPECT_EQ(ratio_note(only_request(line)), "note: 0.4 is taken as 0.4 percent; 40 is 40 percent") << line;
  for (const char* line : {"gripper 0", "gripper 1", "speed 40", "delay 0.4", "joints 0.4"})
    EXPECT_EQ(ratio_note(only_request(line)), "") << line;
}

TEST(Program, SaysOfAllLinesWhetherTheyWereDone) {
  const Program program = parse_program("# head\nready\nopen\n\nclose\nready\nopen\n");
  EXPECT_EQ(describe_others(program, 0), "; lines 3 to 7 were not begun");
  EXPECT_EQ(describe_others(program, 2), "; lines 2 to 3 were done; lines 6 to 7 were not begun");
  EXPECT_EQ(describe_others(program, 4), "; lines 2 to 6 were done");
  EXPECT_EQ(describe_others(parse_program("ready"), 0), "");
}

TEST(Program, RefusesAnEndlessLine) {
  const Program program = parse_program("ready\n" + std::string(5000, 'a') + "\n");
  ASSERT_EQ(program.faults.size(), 1u);
  EXPECT_THAT(program.faults[0].reason, HasSubstr("longer than"));
}

TEST(Program, ReadsPlanesAndBoxes) {
  const auto read = [](const std::vector<std::string>& words) { return parse_request(words); };
  for (const std::vector<std::string>& words : std::vector<std::vector<std::string>>{
           {"workspace"},
           {"workspace", "wall", "0", "-1", "0", "-0.3", "--parts", "tool,links"},
           {"workspace", "cage", "-1", "-1", "0", "1", "1", "2", "--within"},
           {"workspace", "wall", "--remove"},
           {"workspace", "--reset"}}) {
    const auto request = read(words);
    ASSERT_TRUE(std::holds_alternative<Request>(request)) << std::get<std::string>(request);
    EXPECT_EQ(to_string(std::get<Request>(request)), fmt::format("{}", fmt::join(words, " ")));
  }
  EXPECT_EQ(
      std::get<Request>(read({"workspace", "wall", "0", "0", "1", "0", "--parts", "elbow,links"})).parts,
      4u + 8u + 16u + 32u);
  for (const std::vector<std::string>& words :
       std::vector<std::vector<std::string>>{{"workspace", "wall"},
                                             {"workspace", "wall", "0", "0", "1"},
                                             {"workspace", "wall", "0", "0", "1", "0", "1"},
                                             {"workspace", "wall", "0", "0", "1", "0", "--within"},
                                             {"workspace", "wall", "0", "0", "1", "0", "--remove"},
                                             {"workspace", "wall", "--reset"},
                                             {"workspace", "--remove"},
                                             {"workspace", "--remove", "--reset"},
                                             {"workspace", "--parts", "tool"},
                                             {"workspace", "--within"}}) {
    const auto fault = read(words);
    ASSERT_TRUE(std::holds_alternative<std::string>(fault)) << fmt::format("{}", fmt::join(words, " "));
    EXPECT_THAT(std::get<std::string>(fault), HasSubstr("NAME NX NY NZ OFFSET for a plane"));
  }
  for (const std::string parts : {"", "tool,", "hand", "tool, wrist"})
    EXPECT_THAT(std::get<std::string>(read({"workspace", "a", "0", "0", "1", "0", "--parts", parts})),
                HasSubstr("must be of tool, wrist, elbow and links"));
}

TEST(Program, WritesWhatItReads) {
  for (const std::string line :
       {"move 0.2 -0.1 0.05 --above 0.06 --time 2", "speed 50 --joint 2", "speed 50 --all", "drive 1 -10 5",
        "ready", "drive base 10 5", "speed 50 --joint base", "limit base -10 10"}) {
    EXPECT_EQ(to_string(only_request(line)), line);
  }
}

TEST(Program, FilesThatCannotBeReadAreUsageErrors) {
  for (const std::string file : {"/nonexistent/p.corbot", "/"}) {
    try {
      (void)load_program(file);
      ADD_FAILURE() << file;
    } catch (const Failure& failure) {
      EXPECT_EQ(failure.code(), ExitCode::kUsage);
      EXPECT_THAT(failure.what(), HasSubstr(file));
    }
  }
}

TEST(Program, TheShippedExampleHasNoFault) {
  const Program program = load_program(CORBOT_EXAMPLES "/pick_and_place.corbot");
  std::set<Verb> used;
  for (const auto& statement : program.statements) used.insert(statement.request.verb);
  for (const Verb verb :
       {Verb::kMove, Verb::kMoveS, Verb::kMoveC, Verb::kOpen, Verb::kClose, Verb::kDelay, Verb::kReady}) {
    EXPECT_TRUE(used.contains(verb)) << spec_of(verb).word;
  }
}

TEST(Grammar, EveryVerbHasAUniqueWordAndHelp) {
  std::set<std::string_view> words;
  for (const VerbSpec& spec : verbs()) {
    EXPECT_TRUE(words.insert(spec.word).second) << spec.word;
    EXPECT_FALSE(spec.help.empty()) << spec.word;
    EXPECT_EQ(find_verb(spec.word), &spec);
    EXPECT_LE(spec.required, spec.arguments.size());
  }
}

}  // namespace
}  // namespace corbot::cli
