// SPDX-License-Identifier: Apache-2.0
#include "cli/arm/dry_run.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>
#include <utility>
#include <vector>

#include "cli/run_program.h"
#include "client/failure.h"
#include "support/paths.h"

namespace corbot::cli {
namespace {

using client::parse_program;
using client::Program;
using client::Statement;
using testing::AllOf;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::MatchesRegex;
using testing::Not;

constexpr const char* kLynx5 = CORBOT_PROFILES "/lynx5.toml";
constexpr const char* kPuma560 = CORBOT_PROFILES "/puma560.toml";

/// Why the last line of a program is refused, all before it being accepted. Empty: it is not.
std::string refusal_of_last(const std::string& text, const char* profile) {
  DryRun robot(profile);
  const Program program = parse_program(text);
  EXPECT_THAT(program.faults, IsEmpty()) << text;
  std::string refusal;
  for (const Statement& statement : program.statements) {
    EXPECT_EQ(refusal, "") << text;
    refusal = robot.refusal_of(statement.request).value_or("");
  }
  return refusal;
}

TEST(DryRun, WhatALineChangesCountsForTheLinesAfterIt) {
  for (const std::string accepted :
       {"move 0.22 -0.08 0.02", "drive 0 20 20", "joints 20 0 0 0",
        "limit 0 -10 10\nlimit --reset\njoints 20 0 0 0", "base 1 0 0\nmove 1.22 -0.08 0.02",
        "base 1 0 0\nframes --reset\nmove 0.22 -0.08 0.02", "pitch -90\npitch 0\nmove 0.22 -0.08 0.02",
        "override 50\ngripper 40\nopen"}) {
    EXPECT_EQ(refusal_of_last(accepted, kLynx5), "") << accepted;
  }
  const std::vector<std::pair<std::string, std::string>> refused{
      {"move 2 2 2", "too far"},
      {"joints 80 0 0 0\ndrive base 20 50", "joint 0 would be at 100 degrees"},
      {"limit base -10 10\njoints 20 0 0 0", "allowed -10 to 10 degrees"},
      {"joints 20 0 0 0\nlimit 0 -10 10",
       "joint 0 stands at 20 degrees, outside the wanted limits, -10 to 10 degrees"},
      {"speed 1 --all\ndrive 0 20 20", "allowed up to 1.8 degrees/s"},
      {"speed 10 --joint 0\ndrive 0 20 20", "allowed up to 18 degrees/s"},
      {"base 1 0 0\nmove 0.22 -0.08 0.02", "too far"},
      {"tool 0.2 0 0\nmove 0.22 -0.08 0.02", "joint 1 would be at"},
      {"pitch -90\nmove 0.22 -0.08 0.02", "too far"}};
  for (const auto& [program, why] : refused)
    EXPECT_THAT(refusal_of_last(program, kLynx5), HasSubstr(why)) << program;
}

TEST(DryRun, CentimetresAreRecognised) {
  for (const char* profile : {kLynx5, kPuma560}) {
    EXPECT_THAT(refusal_of_last("move 200 50 80", profile), HasSubstr("numbers are metres: 20 cm is 0.20"));
    EXPECT_THAT(refusal_of_last("move 2 2 2", profile), Not(HasSubstr("20 cm")));
  }
}

TEST(DryRun, SettingsThatTheArmDoesNotHaveAreRefused) {
  const std::vector<std::pair<std::string, std::string>> refused{
      {"pitch 300", "allowed -180 to 180"},
      {"orientation 0 0 0", "follows the tool pitch alone"},
      {"limit 0 -100 10", "the limit -100 degrees is outside the range of the profile, -90 to 90 degrees"},
      {"limit 9 0 1", "joint 9, allowed 0 to 3"},
      {"speed 50 --joint 9", "joint 9, allowed 0 to 3"},
      {"drive elbw 1 1", "did you mean 'elbow'?"},
      {"joints 1 2", "2 values, but the arm has 4 joints"},
      {"base 0 0 0 2 0 0 0", "length 2"}};
  for (const auto& [program, why] : refused)
    EXPECT_THAT(refusal_of_last(program, kLynx5), HasSubstr(why)) << program;
  EXPECT_THAT(refusal_of_last("pitch 0", kPuma560),
              HasSubstr("no tool pitch: set the orientation of its tool"));
}

TEST(DryRun, AnArmOfSixJointsTakesTheOrientationThatWasSet) {
  EXPECT_THAT(refusal_of_last("orientation 0 90 0\nmoves 0.4 0 0.1", kPuma560),
              HasSubstr("joint 3 would be at"));
  EXPECT_EQ(
      refusal_of_last("orientation 0 90 0\norientation --reset\nmoverelative 0 0 -0.02 --line", kPuma560),
      "");
}

/// Returns the text of the dry run on the last line's plan.
std::string plan_of_last(const std::string& text) {
  DryRun robot(kLynx5);
  for (const Statement& statement : parse_program(text).statements)
    EXPECT_EQ(robot.refusal_of(statement.request).value_or(""), "") << text;
  return robot.plan();
}

TEST(DryRun, SaysHowLongAMotionTakesAndWhichLimitsItMeets) {
  EXPECT_THAT(plan_of_last("joints 40 0 0 0"), MatchesRegex("  [0-9.]+ s; joint 0 [a-z]+\n"));
  EXPECT_EQ(plan_of_last("joints 40 0 0 0 --time 9"), "  9.00 s; the wanted time\n");
  EXPECT_THAT(plan_of_last("drive 0 20 5"), MatchesRegex("  [0-9.]+ s; the wanted speed\n"));
  EXPECT_EQ(plan_of_last("delay 1.5"), "  1.50 s\n");
  EXPECT_EQ(plan_of_last("joints 40 0 0 0\nspeed 50"), "");
  const std::string to_line = "pitch -60\nmove 0.12 -0.06 0.1\n";
  EXPECT_THAT(plan_of_last(to_line + "moves 0.12 0.06 0.1"),
              AllOf(HasSubstr("tool speed 0."), Not(HasSubstr("singularity"))));
  EXPECT_EQ(plan_of_last(to_line + "moves 0.12 0.06 0.1 --time 9"), "  9.00 s; the wanted time\n");
  EXPECT_THAT(plan_of_last("joints 0 0 8 0\nmoverelative -0.01 0 0 --line"),
              HasSubstr("\n  nearest singularity: pivot 0.0"));
}

TEST(DryRun, TheFirstRefusalHasItsLine) {
  try {
    Program program = parse_program("ready\n\nmove 2 2 2\nmove 3 3 3\n");
    program.name = "p.corbot";
    check_reach(program, kLynx5);
    ADD_FAILURE() << "it was accepted";
  } catch (const client::Failure& failure) {
    EXPECT_EQ(failure.code(), client::ExitCode::kRefused);
    EXPECT_THAT(
        failure.what(),
        HasSubstr("p.corbot:3: move 2 2 2: the robot would refuse this line: the target (2, 2, 2) m"));
    EXPECT_THAT(failure.what(), HasSubstr("the lines after it were not checked; nothing moved"));
  }
  EXPECT_NO_THROW(check_reach(load_program(CORBOT_EXAMPLES "/pick_and_place.corbot"), kLynx5));
  EXPECT_THROW(DryRun("/nowhere.toml"), client::Failure);
}

TEST(DryRun, OneCommandIsNotSeveral) {
  const auto printed = [](const std::string& text) {
    const Program program = parse_program(text);
    testing::internal::CaptureStdout();
    print_program(program);
    check_reach(program, kLynx5);
    std::fflush(stdout);
    return testing::internal::GetCapturedStdout();
  };
  EXPECT_THAT(printed("ready\n"),
              AllOf(HasSubstr("\n1 command: the syntax"), HasSubstr("\n1 command: lynx5 can carry it out"),
                    Not(HasSubstr("1 commands"))));
  EXPECT_THAT(printed("ready\nready\n"), HasSubstr("\n2 commands: lynx5 can carry out all of them"));
}

}  // namespace
}  // namespace corbot::cli
