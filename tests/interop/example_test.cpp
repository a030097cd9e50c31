// SPDX-License-Identifier: Apache-2.0
// The programs of docs/clients.md and examples/, run against a robot as they are.
#include <gmock/gmock.h>
#include <signal.h>
#include <sys/wait.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <optional>
#include <regex>
#include <sstream>

#include <fmt/core.h>

#include "support/paths.h"
#include "support/ports.h"
#include "support/robot_rig.h"

namespace corbot::test {
namespace {

using ::testing::ContainsRegex;
using ::testing::HasSubstr;
using ::testing::Not;
using ::testing::StartsWith;

std::string read_source(const std::string& file) {
  std::ifstream stream(fmt::format("{}/{}", CORBOT_SOURCE_DIR, file));
  std::ostringstream text;
  text << stream.rdbuf();
  EXPECT_FALSE(text.str().empty()) << file;
  return text.str();
}

/// The line of docs/clients.md that begins with `command`, with `directory` in place of build.
std::string documented_command(const std::string& command, const std::string& directory) {
  std::istringstream page(read_source("docs/clients.md"));
  for (std::string line; std::getline(page, line);) {
    if (line.starts_with("    " + command + " ")) {
      return std::regex_replace(line, std::regex("\\bbuild\\b|([CI])build\\b"), "$1" + directory);
    }
  }
  ADD_FAILURE() << "docs/clients.md has no line that begins with " << command;
  return "false";
}

TEST(Clients, ThePageShowsTheExamplesAsTheyAre) {
  const std::string page = read_source("docs/clients.md");
  for (const auto& [language, file] :
       {std::pair{"python", "examples/python/first_move.py"}, std::pair{"cpp", "examples/cpp/first_move.cpp"},
        std::pair{"cpp", "examples/cpp/pick_and_place.cpp"},
        std::pair{"python", "examples/python/pick_and_place.py"},
        std::pair{"java", "examples/java/PickAndPlace.java"}}) {
    const std::string text = read_source(file);
    EXPECT_THAT(page, HasSubstr(fmt::format("```{}\n{}```\n", language, text))) << file;
    EXPECT_LE(std::count(text.begin(), text.end(), '\n'), 65) << file;
  }
}

class FirstMove : public RobotRig {
 protected:
  void SetUp() override {
    RobotRig::SetUp();
    scratch_ = fmt::format("{}/{}", CORBOT_SCRATCH_DIR, name_);
    std::filesystem::create_directory(scratch_);
  }
  void TearDown() override {
    std::filesystem::remove_all(scratch_);
    RobotRig::TearDown();
  }
  static void expect_moved(const RunResult& result) {
    EXPECT_EQ(result.code, 0) << result.output << result.errors;
    EXPECT_THAT(result.output, StartsWith("moved to (0.2, 0.05, 0.08) m\njoints 14.0 "));
    EXPECT_THAT(result.errors, HasSubstr("nothing moved: the target (0.9, 0, 0.1) m is too far"));
  }
  RunResult in_cpp() { return run({CORBOT_BINARY_DIR "/examples/first_move", reference_}); }
  /// None where omniORB for Python is not there.
  static std::optional<RunResult> in_python(const std::string& reference) {
    const std::string out = CORBOT_CLIENTS_OUT "/python";
    if (run({CORBOT_CLIENTS_DIR "/python/prepare", out}, 500.0).code != 0) return std::nullopt;
    return run({"python3", CORBOT_SOURCE_DIR "/examples/python/first_move.py", reference}, 60.0,
               {fmt::format("PYTHONPATH={}/lib", out), "PYTHONDONTWRITEBYTECODE=1",
                fmt::format("PATH={}/lib/bin:{}", out, std::getenv("PATH"))});
  }
  std::string scratch_;
};

TEST_F(FirstMove, InPython) {
  const std::string out = CORBOT_CLIENTS_OUT "/python";
  const RunResult made = run({CORBOT_CLIENTS_DIR "/python/prepare", out}, 500.0);
  if (made.code == 77) GTEST_SKIP() << "skipped: " << made.errors;
  ASSERT_EQ(made.code, 0) << made.errors;
  expect_moved(run({"python3", CORBOT_SOURCE_DIR "/examples/python/first_move.py", reference_}, 60.0,
                   {fmt::format("PYTHONPATH={}/lib", out), "PYTHONDONTWRITEBYTECODE=1",
                    fmt::format("PATH={}/lib/bin:{}", out, std::getenv("PATH"))}));
}

TEST_F(FirstMove, InCppBuiltByCMake) {
  expect_moved(run({CORBOT_BINARY_DIR "/examples/first_move", reference_}));
}

/// A motion of several seconds; where it was stopped, it was not finished.
TEST_F(FirstMove, IsStoppedByCtrlC) {
  const std::string out = CORBOT_CLIENTS_OUT "/python";
  std::vector<std::vector<std::string>> programs{{CORBOT_BINARY_DIR "/examples/first_move", reference_}};
  if (run({CORBOT_CLIENTS_DIR "/python/prepare", out}, 500.0).code == 0)
    programs.push_back({"python3", CORBOT_SOURCE_DIR "/examples/python/first_move.py", reference_});
  arm_->Override(5.0);
  for (const auto& program : programs) {
    Process client(program, {fmt::format("PYTHONPATH={}/lib", out), "PYTHONDONTWRITEBYTECODE=1",
                             fmt::format("PATH={}/lib/bin:{}", out, std::getenv("PATH"))});
    ASSERT_TRUE(wait_for(Corbot::Waiting)) << client.errors();
    client.signal(SIGINT);
    const auto status = client.wait(within(30));
    ASSERT_TRUE(status) << "the program goes on";
    EXPECT_EQ(WEXITSTATUS(*status), 1) << client.errors();
    EXPECT_THAT(client.errors(), HasSubstr("topped by ")) << client.output();
    EXPECT_THAT(client.output(), Not(HasSubstr("moved to")));
    EXPECT_EQ(arm_->Status(), Corbot::Standby);
  }
}

TEST_F(FirstMove, SaysWhatWentWrong) {
  const std::string nowhere = fmt::format("corbaloc::127.0.0.1:{}/{}", free_port(), name_);
  rt_->terminate();
  ASSERT_TRUE(wait_for(Corbot::Error));
  std::vector<RunResult> down{run({CORBOT_BINARY_DIR "/examples/first_move", nowhere})};
  std::vector<RunResult> not_ready{run({CORBOT_BINARY_DIR "/examples/first_move", reference_})};
  if (const auto python = in_python(nowhere)) down.push_back(*python);
  if (const auto python = in_python(reference_)) not_ready.push_back(*python);
  for (const RunResult& result : down) {
    EXPECT_EQ(result.code, 1);
    EXPECT_THAT(result.errors, HasSubstr("is the robot up?"));
    EXPECT_THAT(result.errors, Not(HasSubstr("Traceback")));
  }
  for (const RunResult& result : not_ready) {
    EXPECT_EQ(result.code, 1);
    EXPECT_THAT(result.errors, HasSubstr("NotReady"));
    EXPECT_THAT(result.errors, Not(HasSubstr("is the robot up?")));
    EXPECT_THAT(result.errors, Not(HasSubstr("Traceback")));
  }
}

TEST_F(FirstMove, SaysWhatToDoWhereTheQueueIsFull) {
  while (raised_by([&] { arm_->StartDelay(600.0); }).empty()) {
  }
  std::vector<RunResult> results{in_cpp()};
  if (const auto python = in_python(reference_)) results.push_back(*python);
  for (const RunResult& result : results)
    EXPECT_THAT(result.errors, HasSubstr("16 motions or calls wait already: try again when one has ended"));
  arm_->Stop();
}

TEST_F(FirstMove, NamesTheLimitThatRefusesAPoint) {
  Corbot::JointRanges_var limits = arm_->MovRange();
  limits[0].lower = -5.0;
  limits[0].upper = 5.0;
  arm_->SetSoftLimits(limits);
  std::vector<RunResult> results{in_cpp()};
  if (const auto python = in_python(reference_)) results.push_back(*python);
  for (const RunResult& result : results) {
    EXPECT_EQ(result.code, 0);
    EXPECT_THAT(result.errors,
                HasSubstr("nothing moved: joint range of joint 0: 14.04 is not within -5 to 5\n"));
    EXPECT_THAT(result.errors, HasSubstr("(0.9, 0, 0.1) m is too far"));
  }
}

TEST_F(FirstMove, SaysThatTheQueueIsFull) {
  const auto fill = [&] {
    for (int queued = 0; queued < 1000; ++queued) arm_->StartDelay(60.0);
  };
  EXPECT_THROW(fill(), Corbot::QueueFull);
  std::vector<RunResult> results{in_cpp()};
  if (const auto python = in_python(reference_)) results.push_back(*python);
  for (const RunResult& result : results) {
    EXPECT_EQ(result.code, 1);
    EXPECT_THAT(result.errors, ContainsRegex("QueueFull: [0-9]+ motions or calls wait already"));
  }
  arm_->Stop();
}

TEST_F(FirstMove, InCppBuiltAsThePageSays) {
  const std::string in_source_dir = "cd " CORBOT_SOURCE_DIR " && ";
  for (const char* command : {"/usr/bin/omniidl", "g++"}) {
    const RunResult made = run({"sh", "-c", in_source_dir + documented_command(command, scratch_)}, 300.0);
    ASSERT_EQ(made.code, 0) << made.output << made.errors;
  }
  expect_moved(run({scratch_ + "/first_move", reference_}));
}

class HelloArm : public RobotRig {
 protected:
  void SetUp() override {
    if (!std::filesystem::exists(CORBOT_BINARY_DIR "/examples/hello_arm"))
      GTEST_SKIP() << "skipped: ORBit2 not found";
    RobotRig::SetUp();
    sockets_ = fmt::format("{}/{}", CORBOT_SCRATCH_DIR, name_);
    std::filesystem::create_directory(sockets_);
    std::filesystem::permissions(sockets_, std::filesystem::perms::owner_all);
  }
  void TearDown() override {
    if (sockets_.empty()) return;
    std::filesystem::remove_all(sockets_);
    RobotRig::TearDown();
  }
  RunResult hello(const std::string& reference) {
    return run({CORBOT_BINARY_DIR "/examples/hello_arm", reference}, 60.0, {"ORBIT_SOCKETDIR=" + sockets_});
  }
  std::string sockets_;
};

TEST_F(HelloArm, MovesTheArm) {
  const RunResult result = hello(reference_);
  EXPECT_EQ(result.code, 0) << result.output << result.errors;
  EXPECT_THAT(result.output, HasSubstr("an arm of 4 joints that reaches 0.340 m\n"));
  EXPECT_THAT(result.output, HasSubstr("joints 14.04 "));
  EXPECT_THAT(result.output, HasSubstr("(0.9, 0, 0.1) m is out of reach: the target"));
  EXPECT_THAT(result.output, HasSubstr("joints 0.00 0.00 0.00 0.00 degrees\n"));
}

TEST_F(HelloArm, IsStoppedByCtrlC) {
  arm_->Override(5.0);
  Process client({CORBOT_BINARY_DIR "/examples/hello_arm", reference_}, {"ORBIT_SOCKETDIR=" + sockets_});
  ASSERT_TRUE(wait_for(Corbot::Waiting)) << client.errors();
  client.signal(SIGINT);
  const auto status = client.wait(within(30));
  ASSERT_TRUE(status) << "the program goes on";
  EXPECT_EQ(WEXITSTATUS(*status), 1) << client.errors();
  EXPECT_THAT(client.output(), HasSubstr("topped by "));
  EXPECT_EQ(arm_->Status(), Corbot::Standby);
}

TEST_F(HelloArm, ReportsErrors) {
  EXPECT_EQ(hello("nonsense").code, 1);
  const RunResult unreachable = hello(fmt::format("corbaloc::127.0.0.1:{}/{}", free_port(), name_));
  EXPECT_EQ(unreachable.code, 1);
  EXPECT_THAT(unreachable.output, HasSubstr("asking: IDL:"));
}

}  // namespace
}  // namespace corbot::test
